/* This program's own process, and others of it. */
#ifndef CLI_CHILD_H
#define CLI_CHILD_H

/* Runs it in `folder` by the command line `words`, NULL behind the last, and returns its exit code. Where the
 * child dies instead, says so of `what` and returns CLI_DEFECT. Its errors go on to standard error; the last
 * is cli_last_message(). */
int cli_in_child(const char *what, const char *folder, char **words);

/* To be called before any file is read. A reader that a file has taken over is kept by Landlock from the
 * memory and environment of other processes; where the kernel has none, this process closes its own. That
 * takes debuggers and core files from it, so it is not done elsewhere. */
void cli_self_close(void);

#endif
