/* This program in a child process. */
#ifndef CLI_CHILD_H
#define CLI_CHILD_H

/* Runs it in `folder` by the command line `words`, NULL behind the last, and returns its exit code. Where the
 * child dies instead, says so of `what` and returns CLI_DEFECT. */
int cli_in_child(const char *what, const char *folder, char **words);

#endif
