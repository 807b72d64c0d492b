# Dependencies are built in a layer of their own, which changes only with Cargo.toml and Cargo.lock.
FROM rust:1.95-slim-bookworm AS build
RUN apt-get update && apt-get install --no-install-recommends -y gcc libc6-dev && rm -rf /var/lib/apt/lists/*
WORKDIR /build
COPY Cargo.toml Cargo.lock ./
COPY proto proto
RUN mkdir src && echo 'fn main() {}' > src/main.rs && touch src/lib.rs && cargo build --release --locked
COPY src src
RUN touch src/main.rs src/lib.rs && cargo build --release --locked && strip target/release/conicoid

FROM debian:bookworm-slim
RUN useradd --system --uid 10001 --no-create-home conicoid
COPY --from=build /build/target/release/conicoid /usr/local/bin/conicoid
USER 10001
ENV CONICOID_HTTP=0.0.0.0:8080 CONICOID_GRPC=0.0.0.0:50051 CONICOID_ADMIN=0.0.0.0:9090
EXPOSE 8080 50051 9090
HEALTHCHECK --interval=10s --timeout=3s CMD ["conicoid", "health"]
ENTRYPOINT ["conicoid"]
CMD ["serve"]
