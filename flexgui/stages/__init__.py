"""The stages of the work, one folder each: state, task, panel and plots that no other stage has."""
