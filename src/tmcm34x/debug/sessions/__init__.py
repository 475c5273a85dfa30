"""Run control over a stand-alone program: on a bench, in a served module, or at the other end of a line."""
