/* --density PATTERN=X: factors of the density by objects' names. */
#ifndef CLI_DENSITY_H
#define CLI_DENSITY_H

#include <vdbshade/scene.h>

enum { CLI_MOST_DENSITIES = 256 };

typedef struct cli_densities {
    vsh_density_rule list[CLI_MOST_DENSITIES];
    char *own[CLI_MOST_DENSITIES]; /* the rules' patterns */
    size_t count;
} cli_densities;

/* Takes one more. CLI_OK or an exit code, having said why. */
int cli_density_take(cli_densities *densities, const char *name, const char *value);
void cli_densities_free(cli_densities *densities);

#endif
