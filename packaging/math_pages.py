"""Render the equations of the documents as MathML when the site is built: pages need no script and no network.

mkdocs calls `on_page_content` for every page (mkdocs.yml, hooks)."""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert

# what pymdownx.arithmatex leaves of $...$ and $$...$$ in its generic form
_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.S)
_DISPLAY = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.S)


def on_page_content(content: str, **_) -> str:
    """Replace every equation of a page.

    Args:
        content: the page's HTML.
    Returns:
        The HTML with MathML elements.
    """
    content = _DISPLAY.sub(lambda found: convert(html.unescape(found[1]).strip(), display="block"), content)
    return _INLINE.sub(lambda found: convert(html.unescape(found[1]).strip()), content)
