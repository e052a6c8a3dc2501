//! The OpenAPI 3.1 description of the server, made from the table of its routes.

use axum::http::StatusCode;
use axum::response::Response;
use serde_json::{Map, Value, json};

use crate::endpoints::{ENDPOINTS, Endpoint};
use crate::failure::json_response;

/// `GET /api/openapi.json`.
pub(crate) async fn show_description() -> Response {
    json_response(StatusCode::OK, &describe_endpoints())
}

/// Returns the description.
pub(crate) fn describe_endpoints() -> Value {
    let mut paths = Map::new();
    for endpoint in ENDPOINTS {
        let path = paths.entry(endpoint.path).or_insert_with(|| json!({}));
        path[endpoint.method.to_lowercase()] = describe_endpoint(endpoint);
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "A robot of Armor",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "JSON over HTTP and WebSocket for a running system (docs/web.md).",
            "license": {"name": "Apache-2.0 OR MIT", "identifier": "Apache-2.0 OR MIT"},
        },
        "paths": paths,
        "components": {
            "schemas": {"Error": error_schema()},
            "securitySchemes": {"session": {
                "type": "apiKey", "in": "cookie", "name": "__Host-armor",
                "description": "of a person who has logged in with an invitation; not on loopback",
            }},
        },
    })
}

fn error_schema() -> Value {
    json!({
        "type": "object",
        "required": ["error"],
        "properties": {"error": {
            "type": "object",
            "required": ["status", "what", "where", "remedy"],
            "properties": {
                "status": {"type": "integer"},
                "what": {"type": "string", "description": "what was wrong"},
                "where": {"type": "string", "description": "in which part of the request or system"},
                "remedy": {"type": "string", "description": "what to do"},
            },
        }},
    })
}

fn describe_endpoint(endpoint: &Endpoint) -> Value {
    let in_path = endpoint.path.split(['{', '}']).skip(1).step_by(2).map(
        |name| json!({"name": name, "in": "path", "required": true, "schema": {"type": "string"}}),
    );
    let in_query = endpoint.query.iter().map(|(name, kind, about)| {
        json!({"name": name, "in": "query", "description": about, "schema": {"type": kind}})
    });
    let parameters: Vec<_> = in_path.chain(in_query).collect();
    let (status, about, content) = match endpoint.content_type {
        "" => ("101", "the WebSocket is open", json!({})),
        content_type => ("200", "done", json!({content_type: {}})),
    };
    let error = json!({"application/json": {"schema": {"$ref": "#/components/schemas/Error"}}});
    let mut described = json!({
        "operationId": endpoint.id,
        "summary": endpoint.summary,
        "parameters": parameters,
        "responses": {
            status: {"description": about, "content": content},
            "default": {"description": "what was wrong, where, and what to do", "content": error},
        },
    });
    if let Some(needed) = endpoint.needs {
        described["security"] = json!([{}, {"session": [needed.name()]}]);
    }
    if let Ok(schema) = serde_json::from_str::<Value>(endpoint.body) {
        let content = json!({"application/json": {"schema": schema}});
        described["requestBody"] = json!({"required": true, "content": content});
    }
    described
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn each_route_is_described_once_and_each_body_is_a_schema() {
        let description = describe_endpoints();
        let mut ids = BTreeSet::new();
        for endpoint in ENDPOINTS {
            let described = &description["paths"][endpoint.path][endpoint.method.to_lowercase()];
            assert_eq!(described["summary"], endpoint.summary, "{}", endpoint.path);
            assert!(ids.insert(endpoint.id), "{} is there twice", endpoint.id);
            assert_eq!(described["requestBody"].is_null(), endpoint.body.is_empty());
            if !endpoint.body.is_empty() {
                serde_json::from_str::<Value>(endpoint.body).expect(endpoint.path);
            }
            let in_path = endpoint.path.matches('{').count();
            let parameters = described["parameters"].as_array().unwrap();
            assert_eq!(parameters.len(), in_path + endpoint.query.len(), "{}", endpoint.path);
        }
        let operations = description["paths"].as_object().unwrap().values();
        let count: usize = operations.map(|path| path.as_object().unwrap().len()).sum();
        assert_eq!(count, ENDPOINTS.len());
    }
}
