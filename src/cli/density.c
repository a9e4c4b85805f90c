#include "cli/density.h"

#include "cli/message.h"
#include "cli/options.h"
#include "cli/try.h"

#include <stdlib.h>
#include <string.h>

int cli_density_take(cli_densities *densities, const char *name, const char *value) {
    const char *sign = strrchr(value, '='); /* names may have one, numbers have none */
    if (sign == NULL || sign == value) {
        return cli_usage("%s '%s': expected PATTERN=X", name, value);
    }
    if (densities->count == CLI_MOST_DENSITIES) {
        return cli_usage("%s: more than %d of them", name, CLI_MOST_DENSITIES);
    }
    vsh_density_rule *rule = &densities->list[densities->count];
    CLI_TRY(cli_parse_positive(name, sign + 1, &rule->factor));
    char *own = strndup(value, (size_t)(sign - value));
    if (own == NULL) {
        return cli_out_of_memory(name);
    }
    rule->pattern = densities->own[densities->count++] = own;
    return CLI_OK;
}

void cli_densities_free(cli_densities *densities) {
    for (size_t i = 0; i < densities->count; ++i) {
        free(densities->own[i]);
    }
    densities->count = 0;
}
