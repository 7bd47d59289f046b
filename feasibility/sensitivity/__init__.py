"""One number of a case varied at a time: where the verdict turns."""
