# The base images go by tag: their digests change with every repair of Debian's, and a release should have
# those. Where a build must be the same again, pin them: `docker buildx imagetools inspect IMAGE:TAG` prints the
# digest, to be written as IMAGE:TAG@sha256:... in both FROM lines.
#
# Dependencies are built in a layer of their own, which changes only with Cargo.toml, Cargo.lock and proto/.
FROM rust:1.95-slim-bookworm AS build
WORKDIR /build
COPY Cargo.toml Cargo.lock ./
COPY proto proto
# the Python package is named in the workspace and not built
COPY python/Cargo.toml python/
RUN mkdir -p src data python/src && echo 'fn main() {}' > src/main.rs && touch src/lib.rs python/src/lib.rs \
    && cargo build --release --locked
COPY src src
# copied files may be older than the empty ones that were built above
RUN touch src/main.rs src/lib.rs && cargo build --release --locked --bin conicoid \
    && strip target/release/conicoid

# glibc and libgcc, without a shell or a package manager
FROM gcr.io/distroless/cc-debian12:nonroot
COPY --from=build /build/target/release/conicoid /usr/local/bin/conicoid
COPY LICENSE /usr/share/doc/conicoid/LICENSE
# a volume mounted here takes over the owner, so that --data-dir can be used without root
COPY --from=build --chown=10001:10001 /build/data /data
USER 10001:10001
# Beyond loopback the service starts with keys or client certificates alone, or with
# CONICOID_ALLOW_ANONYMOUS=true.
ENV CONICOID_HTTP=0.0.0.0:8080 CONICOID_GRPC=0.0.0.0:50051 CONICOID_ADMIN=0.0.0.0:9090
EXPOSE 8080 50051 9090
HEALTHCHECK --interval=10s --timeout=3s CMD ["/usr/local/bin/conicoid", "health"]
ENTRYPOINT ["/usr/local/bin/conicoid"]
CMD ["serve"]
