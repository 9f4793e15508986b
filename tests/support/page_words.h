/* What a function of report/page_text.h writes, as a string to be freed. */
#ifndef CA_TEST_PAGE_WORDS_H
#define CA_TEST_PAGE_WORDS_H

#include <stdio.h>

char *page_words(void (*function)(FILE *, const char *), const char *text);

#endif
