// What a shared library of circline shows to those who link it. A public header opens its namespace
// as `namespace CIRCLINE_EXPORT circline {`: all that it declares is then exported, classes with
// their members and virtual tables. Everything else is hidden: internal headers and sources say
// `namespace circline {`.
#ifndef CIRCLINE_ESTIMATORS_EXPORT_H_
#define CIRCLINE_ESTIMATORS_EXPORT_H_

#if defined(__GNUC__)
#define CIRCLINE_EXPORT [[gnu::visibility("default")]]
#else
#define CIRCLINE_EXPORT
#endif

#endif  // CIRCLINE_ESTIMATORS_EXPORT_H_
