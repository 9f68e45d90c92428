"""The command line. The module `program` lists the commands; each command is a module."""
