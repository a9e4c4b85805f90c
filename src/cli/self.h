/* What other processes can see of this one. */
#ifndef CLI_SELF_H
#define CLI_SELF_H

/* To be called before any file is read. A reader that a file has taken over is kept by Landlock from the
 * memory and environment of other processes; where the kernel has none, this process closes its own. That
 * takes debuggers and core files from it, so it is not done elsewhere. */
void cli_self_close(void);

#endif
