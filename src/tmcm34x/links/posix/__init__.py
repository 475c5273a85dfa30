"""Links that only POSIX systems have: pseudo terminals, and the CAN adapter on one."""
