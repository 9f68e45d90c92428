"""The command line. The module `program` lists the commands, and each command has a module."""
