"""What tools are made of, for programs of your own: each module is one noun, to be imported by its name."""
