/* vdbshade merge: the parts of a bake, put together. */
#include "cli/bake/bake.h"
#include "cli/message.h"
#include "cli/paths.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_WORDS = 100000 };
enum { KEY_SHARDS = 0x2000, KEY_STATS, KEY_INVALID, KEY_EXR, KEY_VIEW, KEY_CSV, KEY_PLOT };

typedef struct merge_settings {
    const char *output; /* without slashes at its end: parts of a folder stand beside it */
    const char *folder; /* the same with one */
    const char *stats, *invalid_picture, *exr, *view, *csv, *plot;
    int32_t shards; /* 0: as many as there are */
    cli_common common;
} merge_settings;

static const cli_option options[] = {
    {KEY_SHARDS, "shards", "N", "parts that there are of it, 1 to 10000 (found by their\nnames)"},
    {KEY_INVALID, "invalid", "FILE.png", "these three as of bake, of the whole"},
    {KEY_EXR, "exr", "FILE.exr", "also an EXR of all channels beside a .glb or .gltf"},
    {KEY_VIEW, "view", "PAGE.html", "also a page to look at it in a browser: docs/view.md"},
    {KEY_CSV, "csv", "FILE.csv", "of trade: the table of all runs as CSV"},
    {KEY_PLOT, "plot", "FILE.svg", "of trade: its plot as a picture of its own"},
    {KEY_STATS, "stats", "FILE.json", "write times, counts and peak memory as JSON"},
    CLI_COMMON_OPTIONS,
};

static int merge_main(int argc, char **argv);

const cli_command cli_merge = {
    "merge",
    "OUT [options]",
    "Puts together what 'bake --shard I/N -o OUT', 'volume …' or 'trade …' left in OUT.1-of-N.part to\n"
    "OUT.N-of-N.part: the same file, bit by bit but for times, as without --shard. The parts say\n"
    "by which options; their inputs are read again, from this folder where paths are relative, and must\n"
    "not have changed. Parts stay. See docs/farm.md.",
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
    case KEY_CSV:
        s->csv = value;
        return CLI_OK;
    case KEY_PLOT:
        s->plot = value;
        return CLI_OK;
    default:
        return cli_common_parse(&s->common, key, name, value, &taken);
    }
}

/* The command that its part was made by, but for what this one says. What a part names is read, never
 * written: it may be anybody's. */
static int merge_bake(const merge_settings *s, int argc, char **argv) {
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

static int merge_volume(const merge_settings *s, int argc, char **argv) {
    return cli_volume_merge(argc, argv, s->output, s->shards, s->stats, &s->common);
}

static int merge_trade(const merge_settings *s, int argc, char **argv) {
    const cli_merged merged = {s->output, s->csv, s->plot, s->view, s->shards, &s->common};
    return cli_trade_merge(argc, argv, &merged);
}

/* What parts may be of, and which options are for their outputs. */
static const struct {
    const cli_command *command;
    int (*merge)(const merge_settings *s, int argc, char **argv);
    const char *what;
    bool picture, view, table, stats;
} kinds[] = {
    {&cli_bake, merge_bake, "a lightmap", true, true, false, true},
    {&cli_volume, merge_volume, "a volume", false, false, false, true},
    {&cli_trade, merge_trade, "a trade", false, true, true, false},
};

static int merge(const merge_settings *s, int argc, char **argv) {
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; ++i) {
        if (strcmp(kinds[i].command->name, argv[0]) != 0) {
            continue;
        }
        const char *given = !kinds[i].picture && s->invalid_picture != NULL ? "invalid"
                            : !kinds[i].picture && s->exr != NULL           ? "exr"
                            : !kinds[i].view && s->view != NULL             ? "view"
                            : !kinds[i].table && s->csv != NULL             ? "csv"
                            : !kinds[i].table && s->plot != NULL            ? "plot"
                            : !kinds[i].stats && s->stats != NULL           ? "stats"
                                                                            : NULL;
        return given != NULL ? cli_usage("--%s: %s is %s, which has none", given, s->output, kinds[i].what)
                             : kinds[i].merge(s, argc, argv);
    }
    return cli_usage("%s: its parts are of no bake", s->output);
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
