"""Commands that talk to a module: each is a few lines over `tmcm34x.host`."""
