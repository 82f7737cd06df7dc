"""POV-Ray's messages, from texts that it really printed."""

from __future__ import annotations

from pathlib import Path

from worker.engines.povray.answers.messages import (
    LONGEST_MESSAGE,
    MessageKind,
    Statistics,
    read_messages,
    read_statistics,
    unwrap,
)

LONG_PATH = """\
==== [Parsing...] ==========================================================
File 'a very/long_directory_name_that_does_not_end_before_the_eightieth_column_o
f_the_console_for_sure/unknown_thing.pov' line 2: Parse Error: Expected 'numeric
 expression', undeclared identifier 'Radius_Of_It' found instead
Fatal error in parser: Cannot parse input.
Render failed
""".splitlines()

MISSING_INCLUDE = """\
File '/scratch/bundle/scene.inc' line 2: Possible Parse Error: Cannot find file
 'nowhere_to_be_found.inc', even after trying to append file type extension.
File '/scratch/bundle/scene.inc' line 2: Parse Error: Cannot open include file
 nowhere_to_be_found.inc.
Fatal error in parser: Cannot parse input.
Render failed
""".splitlines()

WARNINGS = """\
Parse Warning: assumed_gamma not specified, so gamma_correction is turned off
 for compatibility with this pre POV-Ray 3.7 scene. See the documentation for
 more details.
File 'divzero.pov' line 2: Parse Warning: Divide by zero.
----------------------------------------------------------------------------
 Parser Statistics
""".splitlines()

STATISTICS = """\
Parser Time
  Parse Time:       0 hours  0 minutes  3 seconds (3.061 seconds)
              using 1 thread(s) with 3.038 CPU-seconds total
  Bounding Time:    0 hours  0 minutes  0 seconds (0.023 seconds)
              using 1 thread(s) with 0.022 CPU-seconds total
Render Time:
  Photon Time:      0 hours  0 minutes  8 seconds (8.047 seconds)
              using 4 thread(s) with 9.431 CPU-seconds total
  Radiosity Time:   No radiosity
  Trace Time:       0 hours  1 minutes  1 seconds (61.500 seconds)
              using 1 thread(s) with 60.250 CPU-seconds total
POV-Ray finished
""".splitlines()


def test_a_path_cut_in_the_middle_of_a_word_is_whole_again() -> None:
    (message,) = read_messages(LONG_PATH)
    folder = "a very/long_directory_name_that_does_not_end_before_the_eightieth_column_of_the_console_for_sure"
    assert message.file == f"{folder}/unknown_thing.pov"
    assert message.line == 2
    assert message.text == "Expected 'numeric expression', undeclared identifier 'Radius_Of_It' found instead"


def test_files_are_named_from_the_bundle() -> None:
    messages = read_messages(MISSING_INCLUDE, roots=[Path("/scratch"), Path("/scratch/bundle")])
    assert [message.kind for message in messages] == [MessageKind.HINT, MessageKind.ERROR]
    assert str(messages[1]) == "scene.inc line 2: Cannot open include file nowhere_to_be_found.inc."


def test_warnings_are_read_with_and_without_a_place() -> None:
    first, second = read_messages(WARNINGS)
    assert (first.kind, first.file) == (MessageKind.WARNING, None)
    assert first.text.endswith("scene. See the documentation for more details.")
    assert str(second) == "divzero.pov line 2: Divide by zero."


def test_lines_that_are_no_message_are_left_as_they_are() -> None:
    assert unwrap(STATISTICS) == STATISTICS


def test_statistics_are_summed_by_what_the_work_was_for() -> None:
    assert read_statistics(STATISTICS) == Statistics(
        parse_s=3.084, parse_cpu_s=3.06, trace_s=69.547, trace_cpu_s=69.681
    )


def test_without_a_trace_there_are_no_statistics() -> None:
    assert read_statistics(STATISTICS[:5]) is None


def test_numbers_that_a_scene_prints_are_text_when_they_are_none() -> None:
    printed = [
        "  Trace Time:       0 hours (1.2.3 seconds)",
        f"  Parse Time:       0 hours ({'9' * 5000} seconds)",
        "              using 1 thread(s) with ... CPU-seconds total",
        f"File 'a.pov' line {'9' * 5000}: Parse Error: no",
    ]
    assert read_statistics(printed) is None
    assert read_messages(printed) == []


def test_a_message_without_end_is_cut() -> None:
    printed = ["Parse Error: " + "x" * 80, *["y" * 16_000] * 3000]
    (message,) = read_messages(printed)
    assert LONGEST_MESSAGE - 20 < len(message.text) < LONGEST_MESSAGE
