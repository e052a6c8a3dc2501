// Components in C: the twelve functions, and components under test. docs/c.md is the guide.
//
// Generated from sdk/c/src; do not edit: ARMOR_BLESS=1 cargo test -p armor-c --test header

#ifndef ARMOR_H
#define ARMOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
// The tables of types contain each other.
typedef struct armor_type armor_type;

// An output keeps its last message for late subscribers.
#define ARMOR_LATCHED 1

// The file need not feed an input.
#define ARMOR_OPTIONAL 2

// Any number of links may feed an input.
#define ARMOR_MANY 4

// What a function returns: `ARMOR_ERROR_NONE`, or why it has done nothing. `armor_last_error` has the
// details.
typedef enum armor_error {
  // It has succeeded.
  ARMOR_ERROR_NONE = 0,
  // The component's own code has failed; see `armor_fail`.
  ARMOR_ERROR_FAILED = 1,
  // A pointer that must be given is NULL.
  ARMOR_ERROR_NULL = 2,
  // A text is not UTF-8.
  ARMOR_ERROR_NOT_UTF8 = 3,
  // A name is malformed.
  ARMOR_ERROR_NAME = 4,
  // A port cannot be declared: twice, after `create`, or too many.
  ARMOR_ERROR_DECLARATION = 5,
  // The component has no such port.
  ARMOR_ERROR_UNKNOWN_PORT = 6,
  // The port was declared with another type.
  ARMOR_ERROR_OTHER_TYPE = 7,
  // The component is not active, so its threads publish nothing.
  ARMOR_ERROR_NOT_ACTIVE = 8,
  // The message is larger than a message can be.
  ARMOR_ERROR_TOO_LARGE = 9,
  // The table that describes a struct is wrong.
  ARMOR_ERROR_TABLE = 10,
  // The bytes are not a message of the type.
  ARMOR_ERROR_MALFORMED = 11,
  // A parameter is unknown, has no value, or its value is of another type.
  ARMOR_ERROR_PARAMETER = 12,
  // A test cannot do what it asks for.
  ARMOR_ERROR_TEST = 13,
  // A bug of the library.
  ARMOR_ERROR_INTERNAL = 14,
  // The history has no such message, or the link of the input keeps no history.
  ARMOR_ERROR_NO_MESSAGE = 15,
} armor_error;

// The type of a field of a struct.
typedef enum armor_field_kind {
  // `bool`
  ARMOR_FIELD_KIND_BOOL = 0,
  // `uint8_t`
  ARMOR_FIELD_KIND_U8 = 1,
  // `int8_t`
  ARMOR_FIELD_KIND_I8 = 2,
  // `uint16_t`
  ARMOR_FIELD_KIND_U16 = 3,
  // `int16_t`
  ARMOR_FIELD_KIND_I16 = 4,
  // `uint32_t`
  ARMOR_FIELD_KIND_U32 = 5,
  // `int32_t`
  ARMOR_FIELD_KIND_I32 = 6,
  // `uint64_t`
  ARMOR_FIELD_KIND_U64 = 7,
  // `int64_t`
  ARMOR_FIELD_KIND_I64 = 8,
  // `float`
  ARMOR_FIELD_KIND_F32 = 9,
  // `double`
  ARMOR_FIELD_KIND_F64 = 10,
  // `armor_string`
  ARMOR_FIELD_KIND_TEXT = 11,
  // A struct or an enum with a table of its own.
  ARMOR_FIELD_KIND_NESTED = 12,
} armor_field_kind;

// How many values a field has.
typedef enum armor_field_form {
  // One.
  ARMOR_FIELD_FORM_ONE = 0,
  // A fixed number: an array in the struct.
  ARMOR_FIELD_FORM_FIXED = 1,
  // Any number: a pointer and a length in the struct.
  ARMOR_FIELD_FORM_LIST = 2,
} armor_field_form;

// The type of a parameter.
typedef enum armor_parameter_type {
  // A number; the file may give it in any unit of the same dimension, the component gets SI.
  ARMOR_PARAMETER_TYPE_NUMBER = 0,
  // A whole number.
  ARMOR_PARAMETER_TYPE_INTEGER = 1,
  // Any text.
  ARMOR_PARAMETER_TYPE_TEXT = 2,
  // One of the choices.
  ARMOR_PARAMETER_TYPE_CHOICE = 3,
  // A file or folder; a relative one is relative to the file that assigns it.
  ARMOR_PARAMETER_TYPE_PATH = 4,
  // `true` or `false`.
  ARMOR_PARAMETER_TYPE_FLAG = 5,
  // `#rrggbb`.
  ARMOR_PARAMETER_TYPE_COLOUR = 6,
} armor_parameter_type;

// Why `exec` is called.
typedef enum armor_call {
  // The component has been activated.
  ARMOR_CALL_STARTED = 0,
  // Its period is over.
  ARMOR_CALL_TICK = 1,
  // It has received data, and the file gives it no rate.
  ARMOR_CALL_DATA = 2,
  // The last call before it is frozen or ended: bring actuators to rest.
  ARMOR_CALL_STOPPING = 3,
} armor_call;

// What `exec` reports.
typedef enum armor_outcome_kind {
  // Nothing.
  ARMOR_OUTCOME_KIND_CARRY_ON = 0,
  // The task is over; no more calls in this activation, except `ARMOR_CALL_STOPPING`.
  ARMOR_OUTCOME_KIND_DONE = 1,
  // The task has failed, with the text of `armor_fail`; no more calls, as after `DONE`.
  ARMOR_OUTCOME_KIND_FAILED = 2,
  // Something happened that the mission may wait for.
  ARMOR_OUTCOME_KIND_EVENT = 3,
} armor_outcome_kind;

// The state of a component.
typedef enum armor_state {
  // It is being built.
  ARMOR_STATE_STARTING = 0,
  // It gets no calls.
  ARMOR_STATE_FROZEN = 1,
  // It works.
  ARMOR_STATE_ACTIVE = 2,
  // It has reported that it is done.
  ARMOR_STATE_DONE = 3,
  // It has failed.
  ARMOR_STATE_FAILED = 4,
} armor_state;

// A message of any type that has been received; valid until it is freed. One thread at a time may use
// it.
typedef struct armor_any armor_any;

// Received data; valid during the call of `data_received`.
typedef struct armor_data armor_data;

// The handle of a component: valid from `create` to the end of the component; its threads may share
// it.
typedef struct armor_handle armor_handle;

// A received message that is kept; valid until it is freed.
typedef struct armor_kept armor_kept;

// A component under test. One thread may use it. Time begins at 1000 s and passes only in
// `armor_test_tick_after` and `armor_test_pass_time`.
typedef struct armor_test armor_test;

// The value of a parameter; valid during the call of `parameter_received`.
typedef struct armor_value armor_value;

// A parameter, as `docs/manifest.md` explains its members. A member that is 0 or NULL is not given.
typedef struct armor_parameter {
  // Its name in a file.
  const char *name;
  // One of `armor_parameter_type`.
  int kind;
  // The unit of a number.
  const char *unit;
  // Its value if the file assigns none, written as in a file; NULL: the file must assign one.
  const char *default_value;
  // The smallest value of a number, in SI; `-INFINITY` for none. Not used if equal to `maximum`.
  double minimum;
  // The largest value of a number, in SI; `INFINITY` for none.
  double maximum;
  // The choices, with spaces between them.
  const char *choices;
  // The form of a text or path, such as `frame`; see `docs/manifest.md`.
  const char *format;
  // What it does, in one line.
  const char *doc;
  // Whether a change in the file reaches the running component.
  bool live;
  // Of a path: whether the component writes there.
  bool written;
} armor_parameter;

// What a port carries, in one line.
typedef struct armor_port_text {
  // The name of the port.
  const char *port;
  // What it carries.
  const char *doc;
  // Of an input: the age from which on the component takes its data for missing, such as `0.5s`, or
  // the name of the parameter that states it; else NULL.
  const char *stale_after;
} armor_port_text;

// An event that the component reports.
typedef struct armor_event {
  // Its name: `on="component.name"` in a mission.
  const char *name;
  // When it is reported, in one line.
  const char *doc;
  // Whether its value is a number.
  bool has_value;
  // The unit of the value.
  const char *unit;
} armor_event;

// Where data comes from, when it was created, and what is missing before it.
typedef struct armor_header {
  // Local name of the input.
  const char *id;
  // System-wide name of the data, `component.output`.
  const char *data;
  // Counts what the output has published, from 0.
  uint64_t sequence;
  // When it was created: system time in seconds.
  double stamp_s;
  // Process start that published it.
  uint64_t instance;
  // How many messages were lost immediately before it.
  uint64_t lost;
} armor_header;

// What `exec` returns: by `armor_carry_on`, `armor_done`, `armor_failed` or `armor_report_event`.
typedef struct armor_outcome {
  // One of `armor_outcome_kind`.
  int kind;
  // The name of the event; else NULL.
  const char *event;
  // The value of the event.
  double value;
} armor_outcome;

// A component: what its manifest has, and its functions. `create` declares the ports and requests
// the parameters; it runs for `--describe` too, so it opens no hardware or files: `exec` does, at
// `ARMOR_CALL_STARTED`.
//
// The functions never run at the same time, but on different threads. Each gets `user`. Those that
// return an `int` return `ARMOR_ERROR_NONE`, or the error of a function that has failed, or that of
// `armor_fail`, which are failures of the component. A C++ exception or a `longjmp` must not leave
// them.
typedef struct armor_component {
  // Name of this kind of component, as the file has it.
  const char *kind;
  // What it does, in one line.
  const char *summary;
  // What can be set in the file.
  const struct armor_parameter *parameters;
  // How many.
  size_t parameter_count;
  // What the ports carry.
  const struct armor_port_text *ports;
  // How many.
  size_t port_count;
  // The events that it reports.
  const struct armor_event *events;
  // How many.
  size_t event_count;
  // Whether it works until it is frozen, and never reports that it is done.
  bool never_done;
  // Whether its task comes to an end by itself.
  bool ends_by_itself;
  // Whether it does nothing without a rate.
  bool needs_rate;
  // Whether it reads data of the system to which no link leads, as a recorder does. Where the file
  // places such a component on another host, that host may read all data.
  bool reads_all;
  // Given to each function.
  void *user;
  // Declares the ports and requests the parameters.
  int (*create)(const struct armor_handle *handle, void *user);
  // A parameter that was requested has arrived, or a live one has changed. NULL if the component
  // requests none.
  int (*parameter_received)(void *user, const char *name, const struct armor_value *value);
  // Data of an input have arrived. Both pointers are valid during the call. May be NULL.
  int (*data_received)(void *user, const struct armor_header *header, const struct armor_data *data);
  // One step of the component's work; `call` is one of `armor_call`. May be NULL.
  struct armor_outcome (*exec)(void *user, int call);
} armor_component;

// One field of a struct that is sent as a message. Use the macros `ARMOR_FIELD` and others.
typedef struct armor_field {
  // Its name in the schema.
  const char *name;
  // The unit of its number, such as `m/s`; NULL or empty without.
  const char *unit;
  // One of `armor_field_kind`.
  int kind;
  // One of `armor_field_form`.
  int form;
  // Where it is in the struct.
  size_t offset;
  // The number of values of a fixed array.
  size_t count;
  // The table of a nested type; else NULL.
  const struct armor_type *of;
  // Whether it may be absent.
  bool is_optional;
  // Where the `bool is_present` of an optional field is in the struct.
  size_t presence;
} armor_field;

// A type of messages: a struct with a table of its fields, or an enum with the names of its values.
typedef struct armor_type {
  // Its name in the schema.
  const char *name;
  // `sizeof` of the struct.
  size_t size;
  // `_Alignof` of the struct, at most 8.
  size_t alignment;
  // The fields, in the order of the schema; NULL of an enum.
  const struct armor_field *fields;
  // How many.
  size_t field_count;
  // The names of the values of an enum, which count from 0; NULL of a struct.
  const char *const *variants;
  // How many.
  size_t variant_count;
} armor_type;

// One piece of an encoded message.
typedef struct armor_piece {
  // Its bytes; may be NULL if the length is 0.
  const void *data;
  // How many.
  size_t len;
} armor_piece;

// A message of a history: when it was created, and what is missing before it.
typedef struct armor_past {
  // Counts what the output has published, from 0.
  uint64_t sequence;
  // When it was created: system time in seconds.
  double stamp_s;
  // Process start that published it.
  uint64_t instance;
  // How many messages were lost immediately before it.
  uint64_t lost;
  // Whether the message before it in the history is not the one that was published before it.
  bool follows_gap;
} armor_past;

// A parameter's value for a component under test, as in a file.
typedef struct armor_setting {
  // The parameter.
  const char *name;
  // Its value, with its unit.
  const char *value;
} armor_setting;

// What a component has reported.
typedef struct armor_report {
  // One of `armor_outcome_kind`.
  int kind;
  // The name of an event, or why it has failed; empty of `ARMOR_OUTCOME_KIND_DONE`. Valid until the
  // next call with this test.
  const char *text;
  // The value of an event.
  double value;
} armor_report;

// A text: UTF-8 and its length in bytes. A received one has a NUL after it.
typedef struct armor_string {
  // The bytes; may be NULL if the length is 0.
  const char *data;
  // How many.
  size_t len;
} armor_string;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Runs a component as this process, by its command line, and returns the exit code of the process:
// `return armor_run(argc, argv, &component);`. It handles SIGINT and SIGTERM, and takes SIGPIPE away.
//
// Contract:
// `argv` has `argc` texts. `component` and all that it leads to are valid until the process ends.
int armor_run(int argc,
              char *const *argv,
              const struct armor_component *component);

// Returns the meaning of an error code. The text is never freed.
const char *armor_error_text(int error);

// Returns the details of the last error on this thread; empty without one. Valid until the next call of
// a function of this header on this thread.
const char *armor_last_error(void);

// Keeps `text` as the last error of this thread, for a function that then returns
// `ARMOR_ERROR_FAILED`. Returns that; `armor_fail` formats the text.
//
// Contract:
// `text` is NULL or a text.
int armor_fail_with(const char *text);

// Writes a line into the component's log. Levels: 10 debug, 20 info, 30 warning, 40 error.
// `armor_write_log` formats the text.
//
// Contract:
// `text` is NULL or a text.
void armor_log_text(int level, const char *text);

// Declares an output. Only in `create`. `flags`: 0 or `ARMOR_LATCHED`: a late subscriber immediately
// gets the last message.
//
// Contract:
// The pointers are NULL or valid; the table and all that it leads to live as long as the component.
int armor_provide(const struct armor_handle *handle,
                  const char *id,
                  const struct armor_type *table,
                  uint32_t flags);

// Declares an output by its schema, such as `Count{count:u64}`, for messages that are encoded by the
// caller; see `armor_send_bytes`. With `ARMOR_ANY` it passes messages on, and has the type of the input
// of any type; see `armor_send_any`.
//
// Contract:
// The pointers are NULL or valid.
int armor_provide_schema(const struct armor_handle *handle,
                         const char *id,
                         const char *schema,
                         uint32_t flags);

// Declares an input. Only in `create`. `flags`: 0, or `ARMOR_OPTIONAL` and `ARMOR_MANY`, added.
//
// Contract:
// As `armor_provide`.
int armor_subscribe(const struct armor_handle *handle,
                    const char *id,
                    const struct armor_type *table,
                    uint32_t flags);

// Declares an input by its schema, for messages that are decoded by the caller; see `armor_data_bytes`.
// With `ARMOR_ANY` it takes the type of its first link; see `armor_any_received`.
//
// Contract:
// The pointers are NULL or valid.
int armor_subscribe_schema(const struct armor_handle *handle,
                           const char *id,
                           const char *schema,
                           uint32_t flags);

// Returns the system-wide name of what an output publishes, `component.output`; NULL if there is no
// such output. Valid until the next call of this function or `armor_subscribed_data` on this thread.
//
// Contract:
// The pointers are NULL or valid.
const char *armor_provided_data(const struct armor_handle *handle,
                                const char *id);

// Returns the system-wide names of what feeds an input, with spaces between them; NULL if nothing does.
// Known from the first call of `exec` on. Valid as that of `armor_provided_data`.
//
// Contract:
// The pointers are NULL or valid.
const char *armor_subscribed_data(const struct armor_handle *handle,
                                  const char *id);

// Requests a parameter; its value arrives in `parameter_received`, before the first call of `exec`.
//
// Contract:
// The pointers are NULL or valid.
int armor_get_parameter(const struct armor_handle *handle, const char *name);

// Waits until every requested parameter has arrived, for at most ten seconds.
//
// Contract:
// `handle` is NULL or valid.
int armor_synchronize(const struct armor_handle *handle);

// Publishes a message: encoded once, and on its way to every subscriber that can take it when this
// returns. Arrays are sent from where they are. `ARMOR_SEND` checks the type of the struct.
//
// A thread that the component has started itself may publish while the component is active.
//
// Contract:
// The pointers are NULL or valid; `message` is a struct of the type that the table describes, and each
// pointer in it whose length is not 0 leads to as many values.
int armor_send_data(const struct armor_handle *handle,
                    const char *id,
                    const struct armor_type *table,
                    const void *message);

// Publishes an encoded message (`docs/protocol.md`, Values), given in the pieces in which it lies in
// memory. It is not checked against the schema.
//
// Contract:
// The pointers are NULL or valid; each piece has as many bytes as it states.
int armor_send_bytes(const struct armor_handle *handle,
                     const char *id,
                     const struct armor_piece *pieces,
                     size_t count);

// Returns the current time of the whole system in seconds since the Unix epoch; in a system with a
// `<clock>` the last value of that clock. NaN if `handle` is NULL.
//
// Contract:
// `handle` is NULL or valid.
double armor_timestamp(const struct armor_handle *handle);

// Forbids the executive to freeze this component. Only in `create`: `ARMOR_ERROR_DECLARATION` after it.
//
// Contract:
// `handle` is NULL or valid.
int armor_set_non_controllable(const struct armor_handle *handle);

// Decodes received data into `message`, a struct of the type that the table describes. Its texts and
// lists are valid during the call of `data_received`. A list of numbers is not copied if it has arrived
// aligned; bytes always are. `ARMOR_DECODE` checks the type of the struct.
//
// Contract:
// The pointers are NULL or valid; `message` is a struct of the type that the table describes.
int armor_decode(const struct armor_data *data,
                 const struct armor_type *table,
                 void *message);

// Returns the encoded message, as it has arrived; valid during the call of `data_received`.
//
// Contract:
// The pointers are NULL or valid.
const uint8_t *armor_data_bytes(const struct armor_data *data, size_t *len);

// Keeps received data beyond the call: a large message stays in the shared memory in which it came,
// unless the component keeps so many that the publisher would lack memory; others are copied once.
// NULL if `data` is NULL. Free it with `armor_kept_free`.
//
// Contract:
// `data` is NULL or valid.
struct armor_kept *armor_keep(const struct armor_data *data);

// Decodes a kept message, as `armor_decode`; its texts and lists are valid until it is freed. One thread
// at a time may use a kept message.
//
// Contract:
// As `armor_decode`.
int armor_decode_kept(const struct armor_kept *kept,
                      const struct armor_type *table,
                      void *message);

// Returns the bytes of a kept message; valid until it is freed.
//
// Contract:
// The pointers are NULL or valid.
const uint8_t *armor_kept_bytes(const struct armor_kept *kept, size_t *len);

// Frees a kept message; NULL is allowed.
//
// Contract:
// `kept` is NULL, or from `armor_keep` and not freed yet.
void armor_kept_free(struct armor_kept *kept);

// Reads a number, in SI; of a ratio in its unit.
//
// Contract:
// The pointers are NULL or valid.
int armor_value_number(const struct armor_value *value, double *number);

// Reads a whole number.
//
// Contract:
// The pointers are NULL or valid.
int armor_value_integer(const struct armor_value *value, int64_t *number);

// Reads a flag.
//
// Contract:
// The pointers are NULL or valid.
int armor_value_flag(const struct armor_value *value, bool *flag);

// Returns a text, a choice or a colour, as written in the file; NULL if the parameter is a number or a
// flag. Valid until the next call with this value.
//
// Contract:
// `value` is NULL or valid.
const char *armor_value_text(const struct armor_value *value);

// Returns a path, resolved against the folder of the file that assigns it; NULL if the parameter is a
// number or a flag. Valid until the next call with this value.
//
// Contract:
// `value` is NULL or valid.
const char *armor_value_path(const struct armor_value *value);

// Takes received data of an input with the schema `ARMOR_ANY`, to be passed on, in this call or later: a
// large message stays in the shared memory in which it came, others are copied once. NULL if the input
// has a type of its own, with the reason in `armor_last_error`. Free it with `armor_any_free`.
//
// Contract:
// `data` is NULL or valid.
struct armor_any *armor_any_received(const struct armor_data *data);

// Passes a message on, on an output with the schema `ARMOR_ANY`: its bytes and its stamp stay as they
// are.
//
// Contract:
// The pointers are NULL or valid.
int armor_send_any(const struct armor_handle *handle,
                   const char *id,
                   const struct armor_any *any);

// Returns the name of the type of a message; NULL if `any` is. Valid until it is freed.
//
// Contract:
// `any` is NULL or valid.
const char *armor_any_type(const struct armor_any *any);

// Returns the schema of a message; NULL if `any` is. Valid until it is freed.
//
// Contract:
// `any` is NULL or valid.
const char *armor_any_schema(const struct armor_any *any);

// Returns when a message was created, in seconds; NaN if `any` is NULL.
//
// Contract:
// `any` is NULL or valid.
double armor_any_stamp(const struct armor_any *any);

// Returns the bytes of a message; NULL if `any` is. Valid until it is freed.
//
// Contract:
// The pointers are NULL or valid.
const uint8_t *armor_any_bytes(const struct armor_any *any, size_t *len);

// Frees a message; NULL is allowed.
//
// Contract:
// `any` is NULL, or from `armor_any_received` or `armor_history_any`, and not freed yet.
void armor_any_free(struct armor_any *any);

// Reads how many messages the history of an input has: those since the component was activated, at
// most as many as `history="n"` of its link. `ARMOR_ERROR_NO_MESSAGE` if the link keeps no history.
//
// `input`: NULL for the input of `data`. `source`: the data of which the history is, `component.output`;
// NULL for that of `data`, or for the only one of another input.
//
// Contract:
// The pointers are NULL or valid.
int armor_history_len(const struct armor_data *data,
                      const char *input,
                      const char *source,
                      size_t *len);

// Describes the message of that age in a history: 0 is the newest, which is the one that is being
// received if `data` is of this input. `ARMOR_ERROR_NO_MESSAGE` if there is none.
//
// Contract:
// The pointers are NULL or valid.
int armor_history_get(const struct armor_data *data,
                      const char *input,
                      const char *source,
                      size_t age,
                      struct armor_past *past);

// Returns the bytes of the message of that age; valid during the call of `data_received`. NULL if there
// is none.
//
// Contract:
// The pointers are NULL or valid.
const uint8_t *armor_history_bytes(const struct armor_data *data,
                                   const char *input,
                                   const char *source,
                                   size_t age,
                                   size_t *len);

// Decodes the message of that age, as `armor_decode`; `ARMOR_HISTORY_DECODE` checks the type of the
// struct.
//
// Contract:
// As `armor_decode`.
int armor_history_decode(const struct armor_data *data,
                         const char *input,
                         const char *source,
                         size_t age,
                         const struct armor_type *table,
                         void *message);

// Takes the message of that age, of an input with the schema `ARMOR_ANY`, as `armor_any_received` takes the
// one that has arrived: with its type, its schema and its stamp, to be passed on in this call or later.
// NULL if there is none, or the input has a type of its own. Free it with `armor_any_free`.
//
// Contract:
// The pointers are NULL or valid.
struct armor_any *armor_history_any(const struct armor_data *data,
                                    const char *input,
                                    const char *source,
                                    size_t age);

// Returns the age of the message whose stamp is nearest to a time; of several, of the newest.
// `ARMOR_NO_AGE` if there are no messages.
//
// Contract:
// The pointers are NULL or valid.
size_t armor_history_nearest(const struct armor_data *data,
                             const char *input,
                             const char *source,
                             double stamp_s);

// Returns the age of the later one of the two messages between which a time lies, to interpolate; that
// of the earlier one, if `earlier_age` is not NULL, is written there. Both are the same if the stamp of a
// message is that time exactly. `ARMOR_NO_AGE` if the time lies between no two messages of the same
// process start of the publisher.
//
// Contract:
// The pointers are NULL or valid.
size_t armor_history_around(const struct armor_data *data,
                            const char *input,
                            const char *source,
                            double stamp_s,
                            size_t *earlier_age);

// Builds a component for a test; the parameters that are not given have their defaults. It is frozen
// until `armor_test_start`. NULL if it cannot be built, with the reason in `armor_last_error`. Free it
// with `armor_test_free`.
//
// Contract:
// The pointers are NULL or valid; `component` and all that it leads to live as long as the test.
struct armor_test *armor_test_build(const struct armor_component *component,
                                    const struct armor_setting *settings,
                                    size_t setting_count);

// Frees a component under test; NULL is allowed.
//
// Contract:
// `test` is NULL, or from `armor_test_build` and not freed yet.
void armor_test_free(struct armor_test *test);

// Activates the component: `exec` with `ARMOR_CALL_STARTED`. As every step of a test, it returns
// `ARMOR_ERROR_FAILED` if the component fails, with the reason in `armor_last_error`.
//
// Contract:
// `test` is NULL or valid.
int armor_test_start(struct armor_test *test);

// Freezes the component: `exec` with `ARMOR_CALL_STOPPING`.
//
// Contract:
// `test` is NULL or valid.
int armor_test_stop(struct armor_test *test);

// Calls `exec` after each message from now on, as in a file that gives the component no rate.
//
// Contract:
// `test` is NULL or valid.
int armor_test_execute_on_data(struct armor_test *test);

// Lets time pass, then calls `exec` with `ARMOR_CALL_TICK`.
//
// Contract:
// `test` is NULL or valid.
int armor_test_tick_after(struct armor_test *test, double seconds);

// Lets time pass without a call.
//
// Contract:
// `test` is NULL or valid.
int armor_test_pass_time(struct armor_test *test, double seconds);

// Changes a live parameter; the value as in a file.
//
// Contract:
// The pointers are NULL or valid.
int armor_test_set_parameter(struct armor_test *test, const char *name, const char *value);

// Hands a message, created now, to the component as data of an input.
//
// Contract:
// As `armor_send_data`.
int armor_test_send(struct armor_test *test,
                    const char *input,
                    const struct armor_type *table,
                    const void *message);

// Hands an encoded message of the type with this schema to the component as data of an input.
//
// Contract:
// As `armor_send_bytes`.
int armor_test_send_bytes(struct armor_test *test,
                          const char *input,
                          const char *schema,
                          const struct armor_piece *pieces,
                          size_t count);

// Returns the number of messages that have been published on an output; 0 if there is no such output.
//
// Contract:
// The pointers are NULL or valid.
size_t armor_test_output_count(const struct armor_test *test,
                               const char *output);

// Decodes the message with this index, from 0, of those that have been published on an output. Its texts
// and lists are valid until the test is freed.
//
// Contract:
// As `armor_decode`.
int armor_test_output(struct armor_test *test,
                      const char *output,
                      size_t index,
                      const struct armor_type *table,
                      void *message);

// Returns the bytes of a message of an output of the type with this schema, as `armor_test_output`;
// NULL if there is none. Valid until the test is freed.
//
// Contract:
// The pointers are NULL or valid.
const uint8_t *armor_test_output_bytes(struct armor_test *test,
                                       const char *output,
                                       size_t index,
                                       const char *schema,
                                       size_t *len);

// Returns the state of the component, one of `armor_state`; -1 if `test` is NULL.
//
// Contract:
// `test` is NULL or valid.
int armor_test_state(const struct armor_test *test);

// Returns the number of reports so far.
//
// Contract:
// `test` is NULL or valid.
size_t armor_test_report_count(const struct armor_test *test);

// Reads the report with this index, from 0.
//
// Contract:
// The pointers are NULL or valid.
int armor_test_report(struct armor_test *test, size_t index, struct armor_report *report);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ARMOR_H */

#include "armor_fields.h"
