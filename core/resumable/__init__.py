"""Many independent cases: who runs them, a file that nothing finished is lost from, going on."""
