//! MBTiles: an SQLite database with the tables `metadata` and `tiles`, or views of these names
//! (<https://github.com/mapbox/mbtiles-spec>).

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use armor_geo::TileNumber;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, OptionalExtension};

use crate::attribution::shorten_attribution;
use crate::error::{OpenError, OpenFault, PictureFault};
use crate::limits::{MAX_QUERY_KILOSTEPS, MAX_TILE_BYTES};
use crate::web_tiles::{TileArchive, WebTiles, bounds_from_degrees, check_format};

/// How every database begins.
pub(crate) const MAGIC: &[u8] = b"SQLite format 3\0";
/// Metadata that is read: the names used here are among the first.
const MAX_METADATA_ROWS: usize = 1_000;
/// Length of a value that is read.
const MAX_VALUE_CHARS: usize = 4_096;
/// Pages that SQLite keeps: 2 MiB.
const CACHE_KIB: i32 = 2_048;

const TILE_QUERY: &str = "SELECT tile_data FROM tiles \
                          WHERE zoom_level = ?1 AND tile_column = ?2 AND tile_row = ?3";

/// An open archive.
pub(crate) struct MbTiles {
    connection: Mutex<Connection>,
    /// Thousands of steps that the query at hand may still take.
    steps_left: Arc<AtomicU32>,
}

/// Opens an archive; returns it with its attribution.
pub(crate) fn open_mbtiles(path: &Path) -> Result<(WebTiles<MbTiles>, Option<String>), OpenError> {
    let file = path.display().to_string();
    let error = |place: &str, fault| OpenError::new(&file, place, fault);
    let damaged = |place: &str, e: rusqlite::Error| {
        error(place, OpenFault::Damaged(format!("SQLite reports: {}", describe(&e))))
    };
    let steps_left = Arc::new(AtomicU32::new(MAX_QUERY_KILOSTEPS));
    let connection = connect(path, &steps_left).map_err(|e| damaged("", e))?;
    let metadata = read_metadata(&connection).map_err(|e| damaged("table metadata", e))?;
    let value = |name: &str| metadata.get(name).map(|value| value.trim());
    // The tiles first: a database of another program has none.
    connection.prepare(TILE_QUERY).map_err(|e| damaged("table tiles", e))?;
    if let Some(format) = value("format") {
        check_format(format).map_err(|fault| error("metadata `format`", fault))?;
    }
    let bounds = value("bounds").filter(|text| !text.is_empty()).map(|text| {
        let numbers: Vec<f64> = text.split(',').filter_map(|it| it.trim().parse().ok()).collect();
        let degrees = <[f64; 4]>::try_from(numbers).map_err(|_| {
            let shown: String = text.chars().take(60).collect();
            OpenFault::Damaged(format!("`{shown}` is not west,south,east,north"))
        })?;
        bounds_from_degrees(degrees)
    });
    let bounds = bounds.transpose().map_err(|fault| error("metadata `bounds`", fault))?;
    let stated = |name: &str| match value(name) {
        None => Ok(None),
        Some(text) => text.parse::<u8>().map(Some).map_err(|_| {
            let shown: String = text.chars().take(60).collect();
            let what = OpenFault::Damaged(format!("`{shown}` is no zoom"));
            error(&format!("metadata `{name}`"), what)
        }),
    };
    let (first, last) = match (stated("minzoom")?, stated("maxzoom")?) {
        (Some(first), Some(last)) => (first, last),
        (first, last) => {
            steps_left.store(MAX_QUERY_KILOSTEPS, Ordering::Relaxed);
            let found = find_zooms(&connection).map_err(|e| damaged("table tiles", e))?;
            let empty = || error("table tiles", OpenFault::Damaged("it has no tiles".to_owned()));
            let found = found.ok_or_else(empty)?;
            (first.unwrap_or(found.0), last.unwrap_or(found.1))
        }
    };
    let attribution = value("attribution").and_then(shorten_attribution);
    let archive = MbTiles { connection: Mutex::new(connection), steps_left };
    let tiles =
        WebTiles::new(archive, bounds, (first, last)).map_err(|fault| error("metadata", fault))?;
    Ok((tiles, attribution))
}

/// Connects for reading, with limits: the schema comes from the file, and may be made to harm.
fn connect(path: &Path, steps_left: &Arc<AtomicU32>) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let mut connection = Connection::open_with_flags(path, flags)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    for (limit, most) in [
        (Limit::SQLITE_LIMIT_LENGTH, MAX_TILE_BYTES as i32 + 1_024),
        (Limit::SQLITE_LIMIT_SQL_LENGTH, 100_000),
        (Limit::SQLITE_LIMIT_COLUMN, 100),
        (Limit::SQLITE_LIMIT_EXPR_DEPTH, 100),
        (Limit::SQLITE_LIMIT_COMPOUND_SELECT, 10),
        (Limit::SQLITE_LIMIT_VDBE_OP, 25_000),
        (Limit::SQLITE_LIMIT_ATTACHED, 0),
        (Limit::SQLITE_LIMIT_WORKER_THREADS, 0),
    ] {
        connection.set_limit(limit, most)?;
    }
    connection.pragma_update(None, "cell_size_check", true)?;
    connection.pragma_update(None, "mmap_size", 0)?;
    // Negative numbers are KiB.
    connection.pragma_update(None, "cache_size", -CACHE_KIB)?;
    connection.pragma_update(None, "query_only", true)?;
    let left = steps_left.clone();
    let is_over = move || {
        let spend = |steps: u32| steps.checked_sub(1);
        left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, spend).is_err()
    };
    connection.progress_handler(1_000, Some(is_over))?;
    Ok(connection)
}

fn describe(error: &rusqlite::Error) -> String {
    if error.sqlite_error_code() == Some(rusqlite::ErrorCode::OperationInterrupted) {
        return "the query takes too many steps; the tiles need an index on zoom_level, \
                tile_column and tile_row"
            .to_owned();
    }
    error.to_string()
}

fn read_metadata(connection: &Connection) -> rusqlite::Result<BTreeMap<String, String>> {
    let mut query = connection.prepare("SELECT name, value FROM metadata")?;
    let mut rows = query.query([])?;
    let mut metadata = BTreeMap::new();
    for _ in 0..MAX_METADATA_ROWS {
        let Some(row) = rows.next()? else { break };
        // Some programs write numbers.
        let text = |index: usize| -> rusqlite::Result<Option<String>> {
            use rusqlite::types::ValueRef;
            Ok(match row.get_ref(index)? {
                ValueRef::Integer(number) => Some(number.to_string()),
                ValueRef::Real(number) => Some(number.to_string()),
                ValueRef::Text(text) => std::str::from_utf8(text).ok().map(str::to_owned),
                ValueRef::Null | ValueRef::Blob(_) => None,
            })
        };
        if let (Some(name), Some(value)) = (text(0)?, text(1)?)
            && value.len() <= MAX_VALUE_CHARS
        {
            metadata.entry(name).or_insert(value);
        }
    }
    Ok(metadata)
}

/// The first and the last zoom that has tiles.
fn find_zooms(connection: &Connection) -> rusqlite::Result<Option<(u8, u8)>> {
    // Two queries: each takes one step of an index, a query for both walks over all.
    let find = |extreme: &str| {
        let query = format!("SELECT {extreme}(zoom_level) FROM tiles");
        connection.query_row(&query, [], |row| row.get::<_, Option<u8>>(0))
    };
    Ok(find("min")?.zip(find("max")?))
}

impl TileArchive for MbTiles {
    fn read_tile(&self, tile: TileNumber) -> Result<Option<Vec<u8>>, PictureFault> {
        let connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
        self.steps_left.store(MAX_QUERY_KILOSTEPS, Ordering::Relaxed);
        // Rows count from the south.
        let row_from_south = (1_u32 << tile.zoom()) - 1 - tile.y();
        let found = connection.prepare(TILE_QUERY).and_then(|mut query| {
            query
                .query_row((tile.zoom(), tile.x(), row_from_south), |row| {
                    Ok(row.get_ref(0)?.as_blob_or_null()?.map(<[u8]>::to_vec))
                })
                .optional()
        });
        found
            .map(Option::flatten)
            .map_err(|e| PictureFault::Damaged(format!("SQLite reports: {}", describe(&e))))
    }
}
