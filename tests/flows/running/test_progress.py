"""Whoever watches the progress of a run hears of every piece of work, and only within its block."""

from flows.running.progress import progress_bar, watch_progress


def test_a_watcher_hears_the_beginning_and_every_piece_until_its_block_ends():
    heard = []
    with watch_progress(lambda *words: heard.append(words)):
        with progress_bar("clips", 3) as advance:
            advance("dry")
            advance("what failed")
            advance("wet", failed=True)
        with progress_bar("films", 0):
            pass
    with progress_bar("clips", 1) as advance:
        advance("dry")
    assert heard == [
        ("clips", 0, 3, "", False),
        ("clips", 1, 3, "dry", False),
        ("clips", 2, 3, "what failed", False),
        ("clips", 3, 3, "wet", True),
        ("films", 0, 0, "", False),
    ]
