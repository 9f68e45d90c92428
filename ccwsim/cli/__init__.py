"""The command line: `program` lists the commands, and each command is one module."""
