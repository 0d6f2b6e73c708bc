"""The commands of ``musync`` as data, a module for each group of users, and the way their results are printed."""
