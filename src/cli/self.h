/* This program as its own reader of files (vsh_run.reader). */
#ifndef CLI_SELF_H
#define CLI_SELF_H

/* To be called with main's argv[0] before cli_reader(). */
void cli_reader_begin(const char *program);

/* The program to start, never NULL. */
const char *cli_reader(void);

#endif
