"""A bridge to a producer of pictures that only keeps what it is told."""

from skidpad.cockpit.bridge import Bridge


class Recorder:
    """A producer that keeps what it is told."""

    def __init__(self):
        self.words = []
        self.result = None

    def say(self, word):
        self.words.append(word)


def bridge(*tabs, **seat):
    """A bridge whose drive has this seat, with the tabs open, one named `a` unless others are given."""
    made = Bridge(Recorder())
    made.told = {"seat": seat}
    for tab in tabs or ("a",):
        made.tabs.note_tab(tab)
    return made
