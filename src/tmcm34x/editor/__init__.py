"""What editors need: questions about a program, the open files, the language server over both."""
