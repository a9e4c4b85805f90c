/* vdbshade merge: the parts of a bake, put together. */
#include "cli/bake/bake.h"
#include "cli/message.h"
#include "cli/paths.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_WORDS = 100000 };
enum { KEY_SHARDS = 0x2000, KEY_STATS, KEY_INVALID, KEY_EXR, KEY_VIEW };

typedef struct merge_settings {
    const char *output; /* without slashes at its end: parts of a folder stand beside it */
    const char *folder; /* the same with one */
    const char *stats, *invalid_picture, *exr, *view;
    int32_t shards; /* 0: as many as there are */
    cli_common common;
} merge_settings;

static const cli_option options[] = {
    {KEY_SHARDS, "shards", "N", "parts that there are of it, 1 to 10000 (found by their\nnames)"},
    {KEY_INVALID, "invalid", "FILE.png", "these three as of bake, of the whole"},
    {KEY_EXR, "exr", "FILE.exr", "also an EXR of all channels beside a .glb or .gltf"},
    {KEY_VIEW, "view", "PAGE.html", "also a page to look at it in a browser: docs/view.md"},
    {KEY_STATS, "stats", "FILE.json", "write times, counts and peak memory as JSON"},
    CLI_COMMON_OPTIONS,
};

static int merge_main(int argc, char **argv);

const cli_command cli_merge = {
    "merge",
    "OUT [options]",
    "Puts together what 'bake --shard I/N -o OUT' left in OUT.1-of-N.part to OUT.N-of-N.part: the same\n"
    "file, bit by bit, as without --shard. The parts say by which options; their inputs are read again,\n"
    "from this folder where paths are relative, and must not have changed. Parts stay. See docs/farm.md.",
    options,
    sizeof options / sizeof options[0],
    merge_main};

static int take(void *settings, int key, const char *name, const char *value) {
    merge_settings *s = settings;
    bool taken;
    switch (key) {
    case KEY_SHARDS:
        return cli_parse_integer(name, value, 1, 10000, &s->shards);
    case KEY_STATS:
        s->stats = value;
        return CLI_OK;
    case KEY_INVALID:
        s->invalid_picture = value;
        return CLI_OK;
    case KEY_EXR:
        s->exr = value;
        return CLI_OK;
    case KEY_VIEW:
        s->view = value;
        return CLI_OK;
    default:
        return cli_common_parse(&s->common, key, name, value, &taken);
    }
}

/* The command that its part was made by, but for what this one says. What a part names is read, never
 * written: it may be anybody's. */
static int merge(const merge_settings *s, int argc, char **argv) {
    if (strcmp(argv[0], cli_bake.name) != 0) {
        return cli_usage("%s: its parts are of no bake", s->output);
    }
    cli_bake_settings bake;
    bool help;
    int code = cli_bake_parse(argc, argv, &bake, &help);
    if (code != CLI_OK || help) {
        cli_densities_free(&bake.densities);
        return code != CLI_OK ? code : cli_usage("%s: its parts are of no bake", s->output);
    }
    bake.common = s->common;
    if (bake.output != NULL) { /* a folder of objects stays one */
        const char *slash = strrchr(bake.output, '/');
        bake.output = slash != NULL && slash[1] == '\0' ? s->folder : s->output;
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
    code = cli_bake_by(&bake);
    cli_densities_free(&bake.densities);
    return code;
}

static int merge_main(int argc, char **argv) {
    merge_settings s = {.common = cli_common_default()};
    bool help;
    int code = cli_parse(&cli_merge, argc, argv, take, &s, "OUT", &s.output, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    const vsh_run run = cli_common_run(&s.common);
    char **words = NULL, *output = cli_end_path(s.output, ""), *folder = cli_end_path(s.output, "/");
    size_t count = 0;
    vsh_error error;
    if (output == NULL || folder == NULL) {
        code = cli_out_of_memory(s.output);
        goto done;
    }
    s.output = output;
    s.folder = folder;
    if (vsh_part_words(s.output, s.shards, &run, &words, &count, &error) != VSH_OK) {
        code = cli_fail(&error);
        goto done;
    }
    code = count > 1 && count < MOST_WORDS ? merge(&s, (int)count, words)
                                           : cli_usage("%s: its parts are of no bake", s.output);
    vsh_part_words_free(words);
done:
    free(folder);
    free(output);
    return code;
}
