"""The shared page: no text becomes markup, and a page needs nothing but itself."""

from beyond_mocap.evaluation.html_page import (
    build_element,
    build_image,
    build_list,
    build_number_cell,
    build_page,
    build_row,
    build_section,
    build_table,
    join_html,
)

BAD = "<b>\"&'</b>"
ESCAPED = "&lt;b&gt;&quot;&amp;&#x27;&lt;/b&gt;"


def test_text_is_escaped_wherever_it_is_put():
    link = build_element("a", BAD, href=BAD)
    table = build_table([BAD], [build_row(BAD, build_element("td", BAD, class_=BAD))])
    parts = (link, BAD, table, build_section(BAD, BAD), build_list([BAD]), build_image(b"png", BAD), join_html(BAD))
    page = build_page(BAD, *parts)
    assert "<b>" not in page and page.count(ESCAPED) == 13


def test_joined_html_is_no_longer_trusted():
    joined = build_element("p", "one") + build_element("p", "two")
    assert build_element("div", joined) == "<div>&lt;p&gt;one&lt;/p&gt;&lt;p&gt;two&lt;/p&gt;</div>"
    assert build_element("div", join_html(build_element("p", "one"), "&")) == "<div><p>one</p>&amp;</div>"


def test_attributes_and_cells():
    assert build_element("input", type="radio", data_needed=True, hidden=False,
                         id=None) == "<input type=radio data-needed>"
    assert build_element("td", colspan=3, class_="n met") == '<td colspan=3 class="n met">'
    cells = [build_number_cell(value, 2, 100.0, "met") for value in (0.1234, float("nan"), None)]
    assert cells == ['<td class="n met">12.34', "<td class=n>–", "<td class=n>–"]
