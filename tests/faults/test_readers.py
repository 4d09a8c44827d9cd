"""No file that somebody damaged gives more than one sentence (item 6): seeded mutations of every reader."""

import random
import resource
import signal
import traceback
import warnings
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from skidpad.core.errors import InputError
from support.faults import called_readers, channel_readers, kept_readers, more_readers, readers

MODULES = (readers, channel_readers, more_readers, kept_readers, called_readers)
READERS = {name: reader for module in MODULES for name, reader in module.READERS.items()}
LISTS = ("openscenario", "played", "storyboard", "catalog")  # name all that is wrong, a line each
LONGEST = 50_000  # characters
IN_CI = 500  # inputs of a reader
TESTS = 10  # of a reader, so that processes that share the readers end together
FAULTS_SHOWN = 12
CPU_S = 300  # of one input; thousands of times what one takes
IN_MEMORY = Path("/dev/shm")
MEMORY = 12 * 2**30  # bytes of addresses; so a greedy input is a fault, not the end of the machine


class TooLong(BaseException):
    """An input took its processor time."""


def stop(signum, frame):
    raise TooLong


def inputs(name, numbers):
    """Damaged files of a reader, each from its own seed."""
    reader = READERS[name]
    seeds = reader.seeds()
    for number in numbers:
        rng = random.Random(zlib.crc32(name.encode()) + number)
        yield number, rng.choice(reader.mutations)(rng, rng.choice(seeds))


def amount(reader, asked):
    """How many inputs a reader gets. asked: None for as many as CI has time for."""
    if asked is None:
        return round(IN_CI * reader.share)
    return asked if reader.most is None else min(asked, reader.most)


def parts(asked, first):
    """The tests: a reader's name and the numbers of its inputs."""
    for name, reader in READERS.items():
        count = amount(reader, asked)
        end, size = first + count, max(IN_CI, count // TESTS)
        for begin in range(first, end, size):
            numbers = range(begin, min(begin + size, end))
            yield pytest.param(name, numbers, id=f"{name}-{begin}" if begin else name)


def pytest_generate_tests(metafunc):
    if "numbers" in metafunc.fixturenames:
        option = metafunc.config.getoption
        tests = list(parts(option("--fuzz"), option("--fuzz-from")))
        metafunc.parametrize("name, numbers", tests)


def refused(reader, path):
    """The sentence that refuses a file, "" when it is read."""
    signal.setitimer(signal.ITIMER_PROF, CPU_S)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            reader.read(path)
    except InputError as error:
        return str(error)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return ""


@pytest.fixture
def bounds():
    """Time is up with an exception, and so is memory."""
    before = signal.signal(signal.SIGPROF, stop)
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    signal.signal(signal.SIGPROF, before)


@pytest.fixture
def folder(tmp_path):
    """In memory where there is a place: readers are tried, and what they write need not reach a disk."""
    with TemporaryDirectory(dir=IN_MEMORY if IN_MEMORY.is_dir() else tmp_path) as name:
        yield Path(name)


def test_damaged_files_are_read_or_refused_in_a_sentence(name, numbers, folder, bounds):
    reader = READERS[name]
    path = folder / reader.file
    for (
        seed
    ) in reader.seeds():  # what is whole is read, and kernels are compiled by no input's clock
        path.write_bytes(seed)
        reader.read(path)
    faults = []
    for number, data in inputs(name, numbers):
        path.write_bytes(data)
        try:
            said = refused(reader, path)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # also what libraries call a panic
            faults.append(f"input {number}: {error!r:.300} in {_place(error)}")
            if len(faults) >= FAULTS_SHOWN:
                break
            continue
        said.encode()
        if len(said) > LONGEST or ("\n" in said.strip() and name not in LISTS):
            faults.append(f"input {number}: says {said!r:.300}")
    assert not faults, "\n".join(faults)


def _place(error):
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "skidpad" in f.filename] or frames
    return f"{ours[-1].filename}:{ours[-1].lineno}"
