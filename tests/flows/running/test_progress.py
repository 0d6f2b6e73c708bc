"""Whoever watches the progress of a run hears of every piece of work, and only within its block."""

from flows.running.progress import Progress, progress_bar, watch_progress


def test_a_watcher_hears_the_beginning_and_every_piece_until_its_block_ends():
    heard = []
    with watch_progress(heard.append):
        with progress_bar("clips", 3) as advance:
            advance("dry", facts={"frames": 81})
            advance("what failed")
            advance("wet", failed=True)
        with progress_bar("films", 0):
            pass
    with progress_bar("clips", 1) as advance:
        advance("dry")
    assert heard == [
        Progress(title="clips", done=0, total=3),
        Progress(title="clips", done=1, total=3, name="dry", facts={"frames": 81}),
        Progress(title="clips", done=2, total=3, name="what failed"),
        Progress(title="clips", done=3, total=3, name="wet", failed=True),
        Progress(title="films", done=0, total=0),
    ]
