"""The dataset on disk: where things lie, Parquet telemetry, Zarr frames, and the commit of a clip."""
