/* Work in a child process of this program. */
#ifndef CLI_CHILD_H
#define CLI_CHILD_H

/* Runs `work` in a child and returns its exit code. Where the child dies instead, says so of `what` and
 * returns CLI_DEFECT. To be called while the process has no threads that hold locks. */
int cli_in_child(const char *what, int (*work)(void *user), void *user);

#endif
