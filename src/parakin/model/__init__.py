"""A machine's mathematics, written once: leg kinds (``legs/``, a file each), structures, limits as margins, traces."""
