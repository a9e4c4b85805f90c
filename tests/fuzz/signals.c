/* Signals of the command line, for targets: an input's run is interrupted when its time is over, and no
 * thread waits for signals. */
#include "cli/cli.h"

#include "fuzz.h"

void cli_signals_begin(void) {}

bool cli_interrupted(void) {
    return fuzz_is_late() != 0;
}

void cli_signals_tell(void) {}

void cli_signals_watch(void) {}

void cli_signals_end(int code) {}
