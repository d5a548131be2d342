"""The words in a drawing."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path


def texts(svg: Path) -> list[str]:
    """What an SVG says, which matplotlib notes in comments beside the letters' outlines."""
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    tree = ElementTree.parse(svg, parser)
    return [(part.text or "").strip() for part in tree.iter() if part.tag is ElementTree.Comment]
