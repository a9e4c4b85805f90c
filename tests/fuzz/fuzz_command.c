/* The command line: words made from the input, run in a folder of small files. Options come from the
 * commands' own tables, so new ones are included. Values are likely ones or text from the input, without '/',
 * because nothing may be written outside of the folder. fork() fails, because the fuzzer has threads by then.
 * So commands that would parse a file in a child end there. The run is interrupted when its time is over, and
 * the machine seems to have 64 MiB. */
#include "fuzz.h"

#include "cli/cli.h"

#include <dirent.h>
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { VALUES = 63, MOST_WORDS = 24, MOST_TEXT = 40, RUNS_A_CLEANING = 256 };

int vdbshade_main(int argc, char **argv);

pid_t __wrap_fork(void);
long __wrap_sysconf(int name);
long __real_sysconf(int name);

pid_t __wrap_fork(void) {
    errno = EAGAIN;
    return -1;
}

long __wrap_sysconf(int name) {
    return name == _SC_PHYS_PAGES ? 16384 : __real_sysconf(name);
}

static const cli_command *const commands[] = {&cli_bake,  &cli_voxelize, &cli_info, &cli_trade,
                                              &cli_query, &cli_volume,   &cli_flat, &cli_render};

/* Likely values; "" is the empty one. */
static const char values[] =
    "a.obj scene.json flat.json points.csv out.exr out.png out.vdb out.csv out.ply out.json out.html "
    "out.tif none - 0 1 2 4 8 16 -1 0.5 1e-3 0,1,0 1,1,1 -1,-1,-1,2,2,2 8x8 16 4x \"\" nan 1e300 "
    "hard classic improved cone rays adaptive exact smooth taps cones sobol blue yes no csv ply raw "
    "1M 20MiB R=ao,A=1 world tangent base avx2 best sphere multiply quadratic 1,1.2,1.5 out "
    "scene2.json";

static const struct {
    const char *name, *text;
} files[] = {
    {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 0.4 0\nvt 0 0.4\nvt 1 0\nvt 1 1\nvt 0.6 0.5\n"
              "f 1/1 3/2 2/3\nf 1/1 2/3 4/2\nf 1/4 4/5 3/6\nf 2/4 3/5 4/6\n"},
    {"scene.json",
     "{\"casters\":[{\"sdf\":{\"shape\":\"sphere\",\"radius\":0.5}}],\"resolution\":12,"
     "\"lights\":[{\"name\":\"sun\",\"type\":\"directional\",\"direction\":[0,1,0],\"angle_deg\":5}],"
     "\"ao\":{\"distance\":0.5},"
     "\"receivers\":[{\"mesh\":\"a.obj\",\"size\":8,\"output\":\"out.exr\"}]}"},
    {"scene2.json",
     "{\"casters\":[{\"mesh\":\"a.obj\"},{\"spheres\":[[0,0,0,1]],\"layer\":\"s\"}],\"resolution\":8,"
     "\"layers\":[{\"name\":\"s\",\"softness\":2}],"
     "\"lights\":[{\"name\":\"a\",\"type\":\"sphere\",\"position\":[0,3,0],\"radius\":0.3}]}"},
    {"flat.json",
     "{\"region\":[-2,-2,2,2],\"size\":8,\"casters\":[{\"shape\":\"box\",\"half_size\":[0.5,0.5]}],"
     "\"lights\":[{\"name\":\"lamp\",\"type\":\"disc\",\"position\":[1,1],\"radius\":0.2}]}"},
    {"points.csv", "x,y,z,nx,ny,nz\n0,1,0,0,1,0\n1,1,1,0,1,0\nnan,0,0,0,1,0\n"},
};

/* Restores the files, and removes all others. */
static void clean(void) {
    DIR *listing = opendir(".");
    FUZZ_REQUIRE(listing != NULL && chdir(fuzz_folder()) == 0);
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        unlink(entry->d_name);
    }
    closedir(listing);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        fuzz_file(files[i].name, files[i].text, strlen(files[i].text));
    }
}

/* Takes text from the input, up to the next NUL. */
static void take_text(fuzz_input *input, char text[MOST_TEXT]) {
    size_t used = 0;
    while (input->left > 0 && used + 1 < MOST_TEXT) {
        const char c = (char)fuzz_byte(input);
        if (c == '\0') {
            break;
        }
        text[used++] = c == '/' ? '_' : c;
    }
    text[used] = '\0';
}

static void take_value(fuzz_input *input, char text[MOST_TEXT]) {
    const uint8_t which = fuzz_byte(input);
    if (which >= 192) {
        take_text(input, text);
        return;
    }
    const char *word = values;
    for (int i = which % VALUES; i > 0; --i) {
        word += strcspn(word, " ") + 1;
    }
    snprintf(text, MOST_TEXT, "%.*s", *word == '"' ? 0 : (int)strcspn(word, " "), word);
}

static int take_words(fuzz_input *input, char text[MOST_WORDS][MOST_TEXT]) {
    int words = 0;
    snprintf(text[words++], MOST_TEXT, "vdbshade");
    const uint8_t first = fuzz_byte(input);
    const cli_command *command = commands[first % 8];
    if (first < 240) {
        snprintf(text[words++], MOST_TEXT, "%s", command->name);
    }
    while (input->left > 0 && words + 2 < MOST_WORDS) {
        const uint8_t kind = fuzz_byte(input);
        const cli_option *option = &command->options[kind % command->option_count];
        if (kind >= 160) {
            take_value(input, text[words++]);
        } else if (option->name != NULL) {
            const char letter = cli_letter_of(option->name);
            const bool is_letter = letter != '\0' && (kind & 1);
            snprintf(text[words++], MOST_TEXT, is_letter ? "-%.1s" : "--%s",
                     is_letter ? (char[2]){letter, '\0'} : option->name);
            if (option->value != NULL) {
                take_value(input, text[words++]);
            }
        }
    }
    return words;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static int runs;
    FUZZ_REQUIRE(runs > 0 || (chdir(fuzz_folder()) == 0 && freopen("/dev/null", "r", stdin) != NULL &&
                              freopen("/dev/null", "w", stdout) != NULL));
    if (runs++ % RUNS_A_CLEANING == 0) {
        clean();
    }
    fuzz_input input = {data, size};
    static char text[MOST_WORDS][MOST_TEXT];
    char *words[MOST_WORDS + 1];
    const int count = take_words(&input, text);
    for (int i = 0; i < count; ++i) {
        words[i] = text[i];
    }
    words[count] = NULL;
    fuzz_run();
    const int code = vdbshade_main(count, words);
    FUZZ_REQUIRE(code == CLI_OK || code == CLI_USAGE || code == CLI_FILE || code == CLI_LIMIT ||
                 code == CLI_INTERRUPTED);
    return 0;
}
