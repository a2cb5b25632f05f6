"""`python -m flexgui` is `flexgui`."""

from flexgui.cli import main

if __name__ == "__main__":
    main()
