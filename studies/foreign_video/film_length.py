"""How much of a film is missing at its end: what its container announces against what it holds."""

from collections.abc import Iterator
from pathlib import Path

import av
from av.container import InputContainer

READ_ONLY = {
    "protocol_whitelist": "file",
    "format_whitelist": "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpeg,mpegts,mpegvideo,h264,hevc,ivf,asf,flv,ogg,"
    "yuv4mpegpipe,gif,apng",
}
"""Options that let FFmpeg open containers of frames only: a playlist would send it to other files or the network."""
WITHOUT_LENGTH = ("h264", "hevc", "m4v", "mpegvideo")
"""Forms without a container, whose length FFmpeg guesses from a bit rate."""


def measure_missing_end(path: Path) -> float:
    """What a container announces of its length beyond its last packet [s]; 0 where it announces nothing.

    Parameters
    ----------
    path : the film
    """
    try:
        with av.open(f"file:{path}", options=dict(READ_ONLY)) as container:
            stream = container.streams.video[0]
            length, clock = stream.duration, stream.time_base
            own = length is not None and clock is not None
            ends, count = [0.0], 0
            for packet in _list_packets(container):
                count += packet.stream_index == stream.index and packet.size > 0
                if packet.pts is not None and (packet.stream_index == stream.index or not own):
                    ends.append(float((packet.pts + (packet.duration or 0)) * packet.time_base))
            if container.format.name == "avi" and stream.average_rate:  # its times are numbers of frames
                return float((stream.frames - count) / stream.average_rate)
            if length is not None and clock is not None:
                return float((length + (stream.start_time or 0)) * clock) - max(ends)
            if container.duration is None or container.format.name in WITHOUT_LENGTH:
                return 0.0
            return container.duration / av.time_base - max(ends)
    except (av.FFmpegError, IndexError):
        return 0.0


def _list_packets(container: InputContainer) -> Iterator[av.Packet]:
    """Packets up to the end, or to where the file is damaged."""
    try:
        yield from container.demux()
    except av.FFmpegError:
        return
