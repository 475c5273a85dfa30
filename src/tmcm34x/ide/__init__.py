"""The TMCL-IDE in the browser: a server on loopback, its page, and what stands between page and module."""
