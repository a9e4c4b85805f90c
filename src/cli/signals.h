/* SIGINT, SIGTERM and SIGHUP: the work is asked to stop, and ended where it does not. */
#ifndef CLI_SIGNALS_H
#define CLI_SIGNALS_H

#include <stdbool.h>

/* From here on the signals only ask; a SIGHUP that is ignored (nohup) stays so. SIGXFSZ and SIGPIPE are
 * ignored, so that a file-size limit and a pipe that nobody reads are errors of the write and not the
 * process's end. */
void cli_signals_begin(void);

bool cli_interrupted(void);

/* Says on standard error that the run was interrupted: once for a process. */
void cli_signals_tell(void);

/* Starts a thread that ends the process with CLI_INTERRUPTED at a second signal, or when the work has not
 * stopped a little after the first. To be called when nothing will be forked any more. */
void cli_signals_watch(void);

/* The file that is being written, so that an end in the middle of it takes the temporary file beside it away;
 * NULL: none. The string must live until the next call. */
void cli_signals_writing(const char *path);

/* The output is written: signals end nothing any more. Not for a cancelled run, which may yet take long to
 * give its memory back. */
void cli_signals_end(void);

#endif
