/* What a folder's regress.json may ask of the command that bakes a case. The folder may be a stranger's, and
 * is run as it came by a CI: what writes files, or parses them unconfined, is for the command line of
 * 'regress' alone. */
#include "cli/message.h"
#include "regress.h"

#include <string.h>

/* Of all commands of cases, what changes values beside settings, which all do. One that is not here is
 * refused: a new option is to be added when it is known to write nothing. */
static const char *const changes_values[] = {
    "receive",      "no-receive", "no-cast",        "one-sided", "sun",    "sun-angle",  "lights",
    "light-radius", "caster",     "treat",          "half",      "band",   "box",        "like",
    "inside",       "name",       "box-voxel-size", "density",   "height", "size-world", "floor"};

static bool is_setting(const char *name) {
    const vsh_setting *setting;
    for (size_t i = 0; (setting = cli_setting(i)) != NULL; ++i) {
        if (strcmp(setting->option, name) == 0) {
            return true;
        }
    }
    return false;
}

static bool may_be_asked(const cli_option *option) {
    bool known = is_setting(option->name);
    for (size_t i = 0; i < sizeof changes_values / sizeof changes_values[0]; ++i) {
        known = known || strcmp(changes_values[i], option->name) == 0;
    }
    return known;
}

int regress_check_options(const regress_case *one, const char *list) {
    for (size_t i = 0; i < one->options.count; ++i) {
        const char *word = one->options.line[i];
        cli_option option; /* of a word "--NAME" or "--NAME=VALUE", spelt out */
        const bool found = strncmp(word, "--", 2) == 0 &&
                           cli_find_option(one->command, word + 2, strcspn(word + 2, "="), &option);
        if (!found || !may_be_asked(&option)) {
            return cli_usage(
                "%s: case '%s': option '%s' of '%s' is not taken from a file: none that changes values; "
                "give --sandbox, --threads and --memory-limit to 'vdbshade regress' itself",
                list, one->name, word, one->command->name);
        }
        i += option.value != NULL && strchr(word, '=') == NULL; /* its value, whatever that looks like */
    }
    return CLI_OK;
}
