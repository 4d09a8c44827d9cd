"""A certificate authority of one's own, for HTTPS between vehicles and fleet."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from datetime import datetime, timedelta, timezone
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from skidpad.core.errors import OutputError
from skidpad.fleet.keys import secret_pem
from skidpad.recording.files import write_bytes, write_secret

VALID = timedelta(days=365)
SKEW = timedelta(hours=1)  # a vehicle's clock may be behind


def make_certificates(folder: Path, hosts: Sequence[str]) -> list[Path]:
    """Writes ca.pem, ca.key, server.pem and server.key and returns their paths.

    hosts: names or IP addresses of the server, the first its common name. OutputError when one of
    the files is there already.
    """
    names = ("ca.pem", "ca.key", "server.pem", "server.key")
    for name in names:
        if (folder / name).exists():
            raise OutputError(f"{folder / name} exists; give another folder")
    ca_key, key = (ec.generate_private_key(ec.SECP256R1()) for _ in range(2))
    issuer = _name("Skidpad fleet authority")
    authority = _sign(_builder(issuer, issuer, ca_key).add_extension(
        x509.BasicConstraints(ca=True, path_length=0), critical=True
    ).add_extension(_usage(signs=True), critical=True), ca_key)  # fmt: skip
    server = _sign(_builder(_name(hosts[0]), issuer, key).add_extension(
        x509.SubjectAlternativeName([_host(host) for host in hosts]), critical=False
    ).add_extension(_usage(signs=False), critical=True).add_extension(
        x509.AuthorityKeyIdentifier.from_issuer_public_key(ca_key.public_key()), critical=False
    ), ca_key)  # fmt: skip
    contents = (_pem(authority), secret_pem(ca_key), _pem(server), secret_pem(key))
    for name, content in zip(names, contents, strict=True):
        (write_secret if name.endswith(".key") else write_bytes)(folder / name, content)
    return [folder / name for name in names]


def _name(common: str) -> x509.Name:
    """Returns an X.509 name with this common name alone."""
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common)])


def _host(host: str) -> x509.GeneralName:
    """Returns a host as an IP address where it is one, else as a DNS name."""
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _usage(signs: bool) -> x509.KeyUsage:
    """Returns the key usage of a certificate that signs others, or of one that does not."""
    return x509.KeyUsage(
        digital_signature=not signs, content_commitment=False, key_encipherment=False,
        data_encipherment=False, key_agreement=False, key_cert_sign=signs, crl_sign=signs,
        encipher_only=False, decipher_only=False,
    )  # fmt: skip


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey
) -> x509.CertificateBuilder:
    """Returns a certificate begun with subject, issuer, public key, number and validity."""
    now = datetime.now(timezone.utc)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - SKEW)
        .not_valid_after(now + VALID)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )


def _sign(builder: x509.CertificateBuilder, key: ec.EllipticCurvePrivateKey) -> x509.Certificate:
    """Returns the certificate signed by the key with SHA-256."""
    return builder.sign(key, hashes.SHA256())


def _pem(certificate: x509.Certificate) -> bytes:
    """Returns the certificate as PEM."""
    return certificate.public_bytes(serialization.Encoding.PEM)
