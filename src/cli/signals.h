/* SIGINT, SIGTERM and SIGHUP ask the work to stop, and end it if it does not. Refused memory ends the program
 * at once (base/guarded_malloc.c), so the command line checks no malloc(). Both remove temporary files. */
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

/* The output is written: signals end nothing any more, and refused memory ends the process with `code`. Not
 * for a cancelled run, which may yet take long to give its memory back. */
void cli_signals_end(int code);

#endif
