/* vdbshade merge: joins the parts of a bake. */
#include "bake/bake.h"

enum { MOST_WORDS = 100000 };

typedef struct merge_settings {
    const char *output; /* without slashes at its end: parts of a folder are beside it */
    const char *stats, *invalid_picture, *exr, *view;
    int32_t shards; /* 0: as many as there are */
} merge_settings;

static const cli_option options[] = {
    {.help = "Output"},
    {"invalid", "FILE.png", "also a picture of invalid texels, as bake writes it",
     CLI_VALUE(TEXT, merge_settings, invalid_picture)},
    {"exr", "FILE.exr", "also an EXR of all channels beside a .glb or .gltf",
     CLI_VALUE(TEXT, merge_settings, exr)},
    {"view", "PAGE.html", "also a page that shows the bake in a browser: docs/view.md",
     CLI_VALUE(TEXT, merge_settings, view)},
    CLI_STATS_OPTION(merge_settings, stats),
    {.help = "Parts"},
    {"shards", "N", "number of parts, 1 to 10000 (found by their names)",
     CLI_RANGE(INTEGER, merge_settings, shards, 1, 10000)},
    CLI_COMMON_OPTIONS,
};

/* Repeats the command of the parts with the outputs of this one. Anybody may have written a part, so files
 * that it names are not written. */
static int merge(const merge_settings *s, int argc, char **argv) {
    CLI_REFUSE_IF(argc < 2 || argc >= MOST_WORDS || strcmp(argv[0], cli_bake.name) != 0,
                  "%s: its parts hold no command of bake; bake them again", s->output);
    cli_bake_settings bake;
    const cli_common given = cli_given;
    const vsh_run run = cli_run;
    const int code = cli_bake_parse(argc, argv, &bake);
    cli_given = given;
    cli_run = run;
    cli_begin_progress(!given.quiet);
    CLI_REFUSE_IF(code == CLI_HELP, "%s: its parts hold no command of bake; bake them again", s->output);
    CLI_TRY(code);
    if (bake.output != NULL) { /* a folder of objects stays one */
        bake.output = *vshi_path_name(bake.output) == '\0' ? cli_end_path(s->output, "/") : s->output;
    }
    bake.merged = s->output;
    bake.shard[0] = 0;
    bake.shard[1] = s->shards;
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
    CLI_TRY(cli_parse(&cli_merge, argc, argv, &s, &s.output));
    s.output = cli_end_path(s.output, "");
    char **words = NULL;
    size_t count = 0;
    CLI_TRY(cli_check(vsh_part_words(s.output, s.shards, &cli_run, &words, &count, &cli_error)));
    const int code = merge(&s, (int)count, words);
    vsh_part_words_free(words);
    return code;
}

const cli_command cli_merge = {
    "merge", "OUT [options]", "parts of a bake on several machines, joined",
    "Joins what 'bake --shard I/N -o OUT' wrote into OUT.1-of-N.part to OUT.N-of-N.part: the same file,\n"
    "bit by bit, as without --shard. The parts hold the options; their inputs are read again, from this\n"
    "folder where paths are relative, and must not have changed. Parts stay. See docs/pipeline.md.",
    CLI_ENDING(options, merge_main)};
