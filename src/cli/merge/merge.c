/* vdbshade merge: the parts of a bake, put together. */
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"

#include <string.h>

enum { MOST_WORDS = 100000, KEY_SHARDS = 0x2000 };

typedef struct merge_settings {
    const char *output; /* without slashes at its end: parts of a folder stand beside it */
    const char *stats, *invalid_picture, *exr, *view;
    int32_t shards; /* 0: as many as there are */
} merge_settings;

static const cli_option options[] = {
    {KEY_SHARDS, "shards", "N", "parts that there are of it, 1 to 10000 (found by their\nnames)"},
    {CLI_TEXT(merge_settings, invalid_picture), "invalid", "FILE.png",
     "these three as of bake, of the whole"},
    {CLI_TEXT(merge_settings, exr), "exr", "FILE.exr", "also an EXR of all channels beside a .glb or .gltf"},
    {CLI_TEXT(merge_settings, view), "view", "PAGE.html",
     "also a page to look at it in a browser: docs/view.md"},
    CLI_STATS_OPTION(merge_settings, stats),
    CLI_COMMON_OPTIONS,
};

static int take(void *settings, int key, const char *name, const char *value) {
    merge_settings *s = settings;
    (void)key; /* --shards: the parser stores the others */
    return cli_parse_integer(name, value, 1, 10000, &s->shards);
}

static int refuse_parts(const merge_settings *s) {
    return cli_usage("%s: its parts are of no bake", s->output);
}

/* Repeats the command of the parts with the outputs of this one. Anybody may have written a part, so nothing
 * is written to files that it names. */
static int merge(const merge_settings *s, int argc, char **argv) {
    if (argc < 2 || argc >= MOST_WORDS || strcmp(argv[0], cli_bake.name) != 0) {
        return refuse_parts(s);
    }
    cli_bake_settings bake;
    const cli_common given = cli_given;
    const int code = cli_bake_parse(argc, argv, &bake);
    cli_given = given;
    cli_progress_begin(given.progress, given.quiet);
    if (code != CLI_OK) {
        return code == CLI_HELP ? refuse_parts(s) : code;
    }
    if (bake.output != NULL) { /* a folder of objects stays one */
        bake.output = *cli_file_name(bake.output) == '\0' ? cli_end_path(s->output, "/") : s->output;
    }
    bake.merged = s->output;
    bake.shard = 0;
    bake.shard_count = s->shards;
    bake.stats = s->stats;
    bake.invalid_picture = s->invalid_picture;
    bake.exr = s->exr;
    bake.view = s->view;
    bake.dry_run = false;
    bake.words = NULL;
    bake.word_count = 0;
    return cli_bake_by(&bake);
}

static int merge_main(int argc, char **argv) {
    merge_settings s = {.shards = 0};
    CLI_TRY(cli_parse(&cli_merge, argc, argv, take, &s, &s.output));
    const vsh_run run = cli_make_run();
    s.output = cli_end_path(s.output, "");
    char **words = NULL;
    size_t count = 0;
    vsh_error error;
    CLI_TRY(cli_check(vsh_part_words(s.output, s.shards, &run, &words, &count, &error), &error));
    const int code = merge(&s, (int)count, words);
    vsh_part_words_free(words);
    return code;
}

const cli_command cli_merge = {
    "merge",
    "OUT [options]",
    "Puts together what 'bake --shard I/N -o OUT' left in OUT.1-of-N.part to OUT.N-of-N.part: the same\n"
    "file, bit by bit, as without --shard. The parts say by which options; their inputs are read again,\n"
    "from this folder where paths are relative, and must not have changed. Parts stay. See\n"
    "docs/pipeline.md.",
    options,
    sizeof options / sizeof options[0],
    merge_main};
