"""Commands that compare a dataset with its manifest, its physical laws, and other datasets."""

from flows.commands.command import (
    DATASET,
    OUT,
    RUNNER,
    Command,
    define_argument,
    define_option,
    require_key,
)

GROUP = "Audits"
KEY = define_option(
    "key", str | None, "File with the signer's Ed25519 public key (PEM), to check the signature.", None
)
VERIFIED = require_key("verified")


COMMANDS = (
    Command(
        name="audit",
        group=GROUP,
        sentence="Verify every hash of a dataset, and compare a share of its clips with the same clips made again.",
        function="flows.auditing.audit:audit_dataset",
        options=(
            DATASET,
            define_option("share", float, "Share of the clips to make again, 0 to 1.", 0.1),
            define_option(
                "seed",
                int | None,
                "Draw these clips by this number, as an earlier audit says; by default by one that nobody foresees.",
                None,
                minimum=0,
            ),
            KEY,
            define_option("out", str | None, "Folder for audit.html, audit.json and audit.txt.", None),
            *RUNNER,
        ),
        passed=VERIFIED,
        output="sentences",
    ),
    Command(
        name="verify",
        group=GROUP,
        sentence="Verify every hash of a dataset, the seal of its manifest and a signature; make nothing.",
        function="flows.auditing.verify:verify_dataset",
        options=(
            DATASET,
            KEY,
            OUT,
        ),
        passed=VERIFIED,
    ),
    Command(
        name="lab sign",
        group=GROUP,
        sentence="Sign a dataset's manifest, and with it every file that it records, with a private key.",
        function="flows.auditing.signing:sign_dataset",
        options=(DATASET, define_option("key", str, "File with the Ed25519 private key: PEM, PKCS#8.")),
        is_flow=False,
    ),
    Command(
        name="lab repair",
        group=GROUP,
        sentence="Make again the files of a dataset that are damaged or missing, to the recorded bytes.",
        function="flows.auditing.repair:repair_dataset",
        options=(DATASET, OUT, *RUNNER),
        passed=require_key("repaired"),
    ),
    Command(
        name="lab gc",
        group=GROUP,
        sentence="Remove the files that killed runs left in a dataset and beside it; finished clips stay.",
        function="flows.auditing.verify:collect_garbage",
        options=(
            define_argument(
                "dataset", str, "Folder or s3:// address of a dataset, finished or not.", in_store=True
            ),
            define_option("dry_run", bool, "List these files and remove nothing.", False),
        ),
    ),
    Command(
        name="lab diff",
        group=GROUP,
        sentence="Compare two datasets: which clips differ, by how much, and which inputs can be the cause.",
        function="flows.auditing.dataset_diff:compare_datasets",
        options=(
            define_argument("a", str, DATASET.help, in_store=True),
            define_argument("b", str, "Another dataset of the same scenarios.", in_store=True),
            OUT,
        ),
        output="sentences",
    ),
    Command(
        name="explain",
        group=GROUP,
        sentence="Follow one frame from the weather to the pixel; each number is computed again beside the stored one.",
        function="flows.auditing.explain:explain_frame",
        options=(
            DATASET,
            define_argument("clip", str, "Label or id of a clip."),
            define_argument("frame", int, "Frame number, from 0."),
            OUT,
        ),
        passed=require_key("agrees"),
        output="sentences",
    ),
)
