"""A checkpoint of a learned judge is a program: one that reaches files is refused before any of it runs."""

import zipfile
from pathlib import Path

import pytest

from studies.evaluation.learned_judges import load_judges
from tasks.errors import InputError

torch = pytest.importorskip("torch")
PLACE = "written-by-a-checkpoint"


class Writes(torch.nn.Module):
    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.from_file("written-by-a-checkpoint", True, 64, dtype=torch.uint8).fill_(7).sum() + x


class Within(torch.nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.inner = torch.nn.Sequential(torch.nn.ReLU(), Writes())

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.inner(x)


class WritesElsewhere(torch.nn.Module):
    @torch.jit.export
    def another(self, x: torch.Tensor) -> torch.Tensor:
        torch.save(x, "written-by-a-checkpoint")
        return x

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x


class WritesWhenLoaded(torch.nn.Module):
    @torch.jit.export
    def __getstate__(self) -> int:
        return 3

    @torch.jit.export
    def __setstate__(self, state: int) -> None:
        written = torch.from_file("written-by-a-checkpoint", True, 64, dtype=torch.uint8).fill_(state)
        self.training = bool(written.sum() > 3)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x


class Computes(torch.nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.layers = torch.nn.Sequential(torch.nn.Conv2d(3, 4, 3), torch.nn.BatchNorm2d(4), torch.nn.GELU())
        self.attention = torch.nn.MultiheadAttention(4, 2)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        if x.mean() > float("inf"):
            raise ValueError("too bright")
        y = self.layers(x).flatten(2).permute(2, 0, 1)
        return self.attention(y, y, y)[0].mean()


def change_code(path: Path, old: bytes, new: bytes) -> None:
    """The checkpoint with other code, as who writes one by hand may have it."""
    with zipfile.ZipFile(path) as archive:
        records = {name: archive.read(name) for name in archive.namelist()}
    assert any(old in content for name, content in records.items() if name.endswith(".py"))
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in records.items():
            archive.writestr(name, content.replace(old, new) if name.endswith(".py") else content)


def write_judges(folder: Path, module: torch.nn.Module) -> Path:
    torch.jit.script(module).save(str(folder / "dover.pt"))
    (folder / "judges.yaml").write_text("dover: {checkpoint: dover.pt, source: a stranger}")
    return folder / "judges.yaml"


@pytest.mark.parametrize("module", [Writes, Within, WritesElsewhere, WritesWhenLoaded])
def test_one_that_writes_files_is_refused_and_writes_none(tmp_path, monkeypatch, module):
    monkeypatch.chdir(tmp_path)
    judges = write_judges(tmp_path, module())
    with pytest.raises(
        InputError, match=r"dover\.pt must be a network that only computes; its program has (from_file|save)"
    ):
        load_judges(judges)
    assert not (tmp_path / PLACE).exists()


@pytest.mark.parametrize(
    ("code", "said"),
    [
        (b'return (x).save("written")', "save"),
        (b'return getattr(x, "sa\\x76e")("written")', "save"),
        (b'return ops.image.write_file("written", x)', "ops.image"),
        (b"return ops.c10d.send([x], x, 0, 0)", "ops.c10d"),
        (
            b'return __torch__.torch.classes.dist_c10d.FileStore("written", 1)',
            "torch.classes.dist_c10d.FileStore",
        ),
        (b"return $(touch written)", "code that cannot be looked through"),
    ],
)
def test_one_whose_code_was_written_by_hand_is_looked_through(tmp_path, code, said):
    judges = write_judges(tmp_path, WritesElsewhere().train())
    change_code(tmp_path / "dover.pt", b"return x", code)
    with pytest.raises(InputError) as caught:
        load_judges(judges)
    assert said in str(caught.value) and "only computes" in str(caught.value)


def test_a_network_of_common_layers_is_taken(tmp_path):
    network = load_judges(write_judges(tmp_path, Computes()))["dover"].network
    assert torch.isfinite(network(torch.rand(1, 3, 8, 8)))
