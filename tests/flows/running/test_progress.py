"""Whoever watches the progress of a run hears of every piece of work, and only within its block."""

from flows.running.progress import progress_bar, watch_progress


def test_a_watcher_hears_the_beginning_and_every_piece_until_its_block_ends():
    heard = []
    with watch_progress(lambda *words: heard.append(words)):
        with progress_bar("clips", 2) as advance:
            advance("dry")
            advance("wet failed")
        with progress_bar("films", 0):
            pass
    with progress_bar("clips", 1) as advance:
        advance("dry")
    assert heard == [
        ("clips", 0, 2, ""),
        ("clips", 1, 2, "dry"),
        ("clips", 2, 2, "wet failed"),
        ("films", 0, 0, ""),
    ]
