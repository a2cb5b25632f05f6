"""What `import flexgui` offers a script or a notebook; results that are tables and figures."""
