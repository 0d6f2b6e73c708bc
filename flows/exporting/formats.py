"""The table of export formats: what writes each of them, and whose reader opens it."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ExportFormat:
    """A form in which a dataset leaves muSync.

    Parameters
    ----------
    name : value of ``--to``
    writer : ``module:function`` below ``flows.exporting``; it takes an open `ExportedDataset` and an empty folder
    files : what lies in the folder
    reader : package whose reader opens it, as a test does value by value; empty where Python has none
    pictures : whether it needs a dataset with frames
    whole : whether it copies the dataset's own files, and so takes all of its clips, those in quarantine too
    package : module that the writer imports and a plain installation lacks; empty where it needs none
    """

    name: str
    writer: str
    files: str
    reader: str
    pictures: bool = False
    whole: bool = False
    package: str = ""


FORMATS: tuple[ExportFormat, ...] = (
    ExportFormat(
        name="webdataset",
        writer="webdataset:write_webdataset",
        files="a .tar a clip, a sample a frame",
        reader="webdataset",
        pictures=True,
    ),
    ExportFormat(
        name="mcap", writer="mcap:write_mcap", files="an .mcap a clip", reader="mcap", package="mcap"
    ),
    ExportFormat(
        name="lerobot",
        writer="lerobot:write_lerobot",
        files="LeRobot v3: data/, videos/, meta/",
        reader="lerobot",
        pictures=True,
    ),
    ExportFormat(
        name="kitti",
        writer="kitti:write_kitti",
        files="odometry/ and raw/ with OXTS",
        reader="pykitti",
        pictures=True,
    ),
    ExportFormat(
        name="nerfstudio",
        writer="nerfstudio:write_nerfstudio",
        files="a folder a clip with transforms.json; scenes/*.ply",
        reader="plyfile",
        pictures=True,
    ),
    ExportFormat(
        name="nuscenes",
        writer="nuscenes:write_nuscenes",
        files="tables, samples/, can_bus/",
        reader="nuscenes-devkit",
        pictures=True,
    ),
    ExportFormat(
        name="rerun", writer="rerun:write_rerun", files="an .rrd a clip", reader="rerun-sdk", package="rerun"
    ),
    ExportFormat(
        name="mdf4", writer="mdf4:write_mdf4", files="an .mf4 a clip", reader="asammdf", package="asammdf"
    ),
    ExportFormat(
        name="coco",
        writer="coco:write_coco",
        files="annotations.json, images/",
        reader="pycocotools",
        pictures=True,
    ),
    ExportFormat(name="tum", writer="tum:write_tum", files="a .txt a clip", reader="evo"),
    ExportFormat(
        name="opendrive",
        writer="opendrive:write_opendrive",
        files="an .xodr a street",
        reader="scenariogeneration, asam-qc-opendrive",
    ),
    ExportFormat(name="opencrg", writer="opencrg:write_opencrg", files="a .crg a clip", reader=""),
    ExportFormat(
        name="croissant",
        writer="croissant:write_croissant",
        files="croissant.json, telemetry/",
        reader="mlcroissant",
        whole=True,
    ),
    ExportFormat(
        name="ro-crate",
        writer="rocrate:write_rocrate",
        files="ro-crate-metadata.json, prov.json, telemetry/, inputs/",
        reader="roc-validator, prov",
        whole=True,
    ),
)
FORMAT_NAMES = tuple(row.name for row in FORMATS)
