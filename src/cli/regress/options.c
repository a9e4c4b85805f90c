/* What a folder's regress.json may ask of the command that bakes a case. The folder may be a stranger's, and
 * is run as it came by a CI: what writes files, or parses them unconfined, is for the command line of
 * 'regress' alone. */
#include "cli/message.h"
#include "regress.h"

#include <string.h>

/* Options that change values, of all commands of cases. One that is not here is refused: a new option is to
 * be added when it is known to write nothing. */
static const char *const changes_values[] = {"size",
                                             "bits",
                                             "pack",
                                             "color-space",
                                             "invalid-channel",
                                             "receive",
                                             "no-receive",
                                             "no-cast",
                                             "allow-overlap",
                                             "sun",
                                             "sun-angle",
                                             "ao",
                                             "ao-method",
                                             "ao-cones",
                                             "method",
                                             "irradiance",
                                             "ambient",
                                             "tint",
                                             "bent-normals",
                                             "sky",
                                             "max-error",
                                             "rays",
                                             "sampler",
                                             "frame",
                                             "jitter",
                                             "early-rays",
                                             "error",
                                             "caster",
                                             "resolution",
                                             "voxel-size",
                                             "solid",
                                             "shell",
                                             "inward",
                                             "unit",
                                             "cast-blended",
                                             "half-width",
                                             "shell-thickness",
                                             "uv-set",
                                             "supersample",
                                             "padding",
                                             "ao-spacing",
                                             "half",
                                             "band",
                                             "box",
                                             "box-voxel-size",
                                             "like",
                                             "inside",
                                             "name"};

/* The option of a word "--NAME" or "--NAME=VALUE", spelt out; NULL: it is none of this command's. */
static const cli_option *option_of(const cli_command *command, const char *word) {
    const size_t length = strncmp(word, "--", 2) == 0 ? strcspn(word + 2, "=") : 0;
    for (size_t i = 0; i < command->option_count && length > 0; ++i) {
        const cli_option *option = &command->options[i];
        if (option->key != 0 && strlen(option->name) == length &&
            strncmp(option->name, word + 2, length) == 0) {
            return option;
        }
    }
    return NULL;
}

static bool may_be_asked(const cli_option *option) {
    bool known = false;
    for (size_t i = 0; i < sizeof changes_values / sizeof changes_values[0] && option != NULL; ++i) {
        known = known || strcmp(changes_values[i], option->name) == 0;
    }
    return known;
}

int regress_check_options(const regress_case *one, const char *list) {
    for (size_t i = 0; i < one->options.count; ++i) {
        const char *word = one->options.line[i];
        const cli_option *option = option_of(one->command, word);
        if (!may_be_asked(option)) {
            return cli_usage(
                "%s: case '%s': option '%s' of '%s' is not taken from a file: none that changes values; "
                "give --trusted, --threads and --memory-limit to 'vdbshade regress' itself",
                list, one->name, word, one->command->name);
        }
        i += option->value != NULL && strchr(word, '=') == NULL; /* its value, whatever that looks like */
    }
    return CLI_OK;
}
