"""The command line: `program` knows the commands, every command is one file."""
