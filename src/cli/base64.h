/* Bytes as letters, for what stands in a page itself. */
#ifndef CLI_BASE64_H
#define CLI_BASE64_H

#include <stdint.h>
#include <stdio.h>

/* RFC 4648; begin with {.out = FILE}. */
typedef struct cli_base64 {
    FILE *out;
    uint32_t held; /* of three bytes that wait */
    int holding;
} cli_base64;

void cli_base64_put(cli_base64 *to, uint8_t byte);
void cli_base64_end(cli_base64 *to);

#endif
