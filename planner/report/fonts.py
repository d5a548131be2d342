"""Fonts for any script: matplotlib's own, and where it lacks letters, what the system has."""

from collections.abc import Iterable
from pathlib import Path

OWN = "DejaVu Sans"  # comes with matplotlib: the same letters everywhere


def font_families(text: str) -> tuple[list[str], list[str]]:
    """Return the fonts by which a text can be written, first the usual one; and what none has.

    Fonts of the system are looked through only where the usual one lacks a letter.
    """
    from matplotlib import font_manager

    families = [OWN]
    missing = _without(text, font_manager.findfont(OWN))
    if not missing:
        return families, []
    for path in sorted(font_manager.findSystemFonts()):
        left = _without(missing, path)
        if len(left) < len(missing):
            font_manager.fontManager.addfont(path)
            families.append(font_manager.get_font(path).family_name)
            missing = left
        if not missing:
            break
    return families, missing


def _without(text: Iterable[str], font: str | Path) -> list[str]:
    """Return the characters that a font lacks; all, if it is none that can be drawn with."""
    from matplotlib import ft2font

    characters = sorted({character for character in text if not character.isspace()})
    try:
        opened = ft2font.FT2Font(str(font))
        opened.set_size(12.0, 72.0)  # fails where letters are pictures, as of emoji
        if not opened.scalable:
            return characters
        known = opened.get_charmap()
    except (RuntimeError, OSError, ValueError):
        return characters
    return [character for character in characters if ord(character) not in known]
