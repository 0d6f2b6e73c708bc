"""Records of datasets: canonical JSON, content ids, provenance, frozen manifests, and their comparison."""
