"""What a worker can be asked to do: one file per kind of task, one function in it.

Each takes plain arguments and a `progress`. Heavy imports stand inside, so that the page may
import a task to name it.
"""
