"""What was made: canonical JSON, content ids, provenance, frozen manifests, and comparing two of them."""
