#include "import/number.h"

#include <string.h>

size_t ca_next_token(const char **cursor, const char **token)
{
    static const char separators[] = " \t\r\n,";
    *token = *cursor + strspn(*cursor, separators);
    const size_t length = strcspn(*token, separators);
    *cursor = *token + length;
    return length;
}
