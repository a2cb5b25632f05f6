"""Forces beyond the bare arm, stated in symbols and compiled one by one."""
