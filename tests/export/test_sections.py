"""Texts of several things: what is so of all of them is told once."""

from hypothesis import given
from hypothesis import strategies as st

from planner.export.sections import Section, told_once

LINES = st.lists(st.sampled_from("abcd"), unique=True, max_size=4)


@given(st.lists(st.tuples(LINES, LINES), min_size=1, max_size=3))
def test_every_line_is_told_of_whom_it_is_so_and_no_line_twice(each: list[tuple[str, ...]]) -> None:
    shared, own = told_once([[Section(one) for one in lines] for lines in each])
    for lines, rest in zip(each, own, strict=True):
        for given_lines, common, left in zip(lines, shared, rest, strict=True):
            assert sorted([*common.lines, *left.lines]) == sorted(given_lines)
    for k, common in enumerate(shared):
        assert set(common.lines) == set.intersection(*(set(lines[k]) for lines in each))


def test_a_table_is_told_once_or_whole() -> None:
    one, other = (Section(("head", row), whole=True) for row in "ab")
    shared, own = told_once([[one], [other]])
    assert [section.lines for section in shared] == [()]
    assert [list(sections[0].lines) for sections in own] == [["head", "a"], ["head", "b"]]
    assert own[0][0].named("UAV 1") == ["UAV 1: head", "a"]
    assert Section(["a", "b"], "these:").named("UAV 1") == ["UAV 1: these:", "UAV 1: a", "UAV 1: b"]
    assert Section([], "these:").named("UAV 1") == []
