/* The main() of most test programs: it runs the tests that they list. Started as a reader
 * (vsh_run.reader is the program itself), it serves. */
#include <unistd.h>

#include <vdbshade/vdbshade.h>

int run_listed_tests(void); /* testing.h */

int main(int argc, char **argv) {
    const int served = vsh_reader_serve(argc, argv);
    if (served >= 0) {
        _exit(served);
    }
    return run_listed_tests();
}
