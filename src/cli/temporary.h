/* Temporary files beside outputs: ".NAME.PID.tmp…", as the library names its own. */
#ifndef CLI_TEMPORARY_H
#define CLI_TEMPORARY_H

/* Removes this process's temporary files from the folder of `target`. */
void cli_temporary_remove(const char *target);

/* Writes a text file: whole, or not at all. Returns CLI_OK or, having said why, CLI_FILE. */
int cli_temporary_write(const char *target, const char *text);

/* Whether cli_temporary_write() is likely to succeed: CLI_OK or, having said why, CLI_FILE. */
int cli_temporary_check(const char *target);

#endif
