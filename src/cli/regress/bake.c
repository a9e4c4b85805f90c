/* Bakes in child processes, and golden bakes that are replaced. */
#include "cli/child.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/temporary.h"
#include "regress.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOST_WORDS = 1024 };

int regress_bake(const regress_work *work, const regress_case *one) {
    const cli_common *common = &work->settings->compare.common;
    char threads[32], memory[48];
    snprintf(threads, sizeof threads, "%d", common->threads);
    snprintf(memory, sizeof memory, "%llu", (unsigned long long)common->memory_limit);
    if (one->options.count > MOST_WORDS - 16) {
        return cli_usage("%s: '%s' has more than %d options", work->folder, one->name, MOST_WORDS - 16);
    }
    char *output = one->output != NULL ? regress_path(work->bakes, one->output) : NULL;
    if (one->output != NULL && output == NULL) {
        return cli_out_of_memory(work->folder);
    }
    /* arrays: words of a command line may be written to */
    char program[] = "vdbshade", name[32], file[] = "--output", folder[] = "--output-folder",
         quiet[] = "--quiet";
    char limit[] = "--memory-limit", pool[] = "--threads", sandbox[] = "--sandbox", off[] = "off",
         require[] = "require", outside[] = "--allow-outside";
    snprintf(name, sizeof name, "%s", one->command->name);
    /* a scene "--stats=x.json" is a file in the folder, and no option */
    char *scene = one->scene[0] == '-' ? regress_path(".", one->scene) : strdup(one->scene);
    if (scene == NULL) {
        free(output);
        return cli_out_of_memory(work->folder);
    }
    char *words[MOST_WORDS];
    size_t count = 0;
    words[count++] = program;
    words[count++] = name;
    words[count++] = scene;
    for (size_t i = 0; i < one->options.count; ++i) {
        words[count++] = one->options.line[i];
    }
    words[count++] = output != NULL ? file : folder;
    words[count++] = output != NULL ? output : work->bakes;
    words[count++] = quiet;
    words[count++] = limit;
    words[count++] = memory;
    if (common->threads > 0) {
        words[count++] = pool;
        words[count++] = threads;
    }
    if (common->sandbox != CLI_SANDBOX_AUTO) {
        words[count++] = sandbox;
        words[count++] = common->sandbox == CLI_SANDBOX_OFF ? off : require;
    }
    if (common->allow_outside) {
        words[count++] = outside;
    }
    words[count] = NULL;
    /* in the folder of the scenes, which the files in options are relative to */
    const int code = cli_in_child(one->scene, work->folder, words);
    free(scene);
    free(output);
    return code;
}

static int copy(const char *from, const char *to) {
    FILE *file = fopen(from, "rb");
    if (file == NULL) {
        cli_say("%s: cannot be read: %s", from, strerror(errno));
        return CLI_FILE;
    }
    cli_temporary target;
    int code = cli_temporary_begin(&target, to);
    if (code != CLI_OK) {
        fclose(file);
        return code;
    }
    char bytes[65536];
    size_t count;
    while ((count = fread(bytes, 1, sizeof bytes, file)) > 0 &&
           fwrite(bytes, 1, count, target.file) == count) {
    }
    if (ferror(file)) {
        cli_say("%s: cannot be read", from);
        cli_temporary_abandon(&target);
        code = CLI_FILE;
    } else {
        code = cli_temporary_commit(&target);
    }
    fclose(file);
    return code;
}

int regress_update(const regress_work *work, const char *output) {
    if (mkdir(work->golden, 0777) != 0 && errno != EEXIST) {
        cli_say("%s: cannot be made: %s", work->golden, strerror(errno));
        return CLI_FILE;
    }
    char *from = regress_path(work->bakes, output), *to = regress_path(work->golden, output);
    int code = from != NULL && to != NULL ? cli_check_links(work->golden, to) : cli_out_of_memory(output);
    code = code == CLI_OK ? copy(from, to) : code;
    free(from);
    free(to);
    return code;
}
