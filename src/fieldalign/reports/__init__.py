"""Reports: pictures of a result, for people."""
