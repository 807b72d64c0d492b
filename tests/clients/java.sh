# openapi-generator java, library native (java.net.http). What it stands on is in the generator's own archive and in Debian's
# libhttpmime-java; an annotation that new Java versions lack is written here.
generate java java --library native --additional-properties=openApiNullable=false,hideGenerationTimestamp=true
archive=$(find venv -name openapi-generator.jar)
classes=$archive:/usr/share/java/httpmime.jar:/usr/share/java/httpclient.jar:/usr/share/java/httpcore.jar
sources=java/src/main/java
mkdir -p $sources/tried $sources/javax/annotation
cp "$here/Try.java" $sources/tried/
cat > $sources/javax/annotation/Generated.java <<'JAVA'
package javax.annotation;

public @interface Generated {
    String[] value();
    String comments() default "";
}
JAVA
find $sources -name '*.java' > sources
javac -nowarn -parameters -proc:none -d classes -cp "$classes" @sources
java -cp "classes:$classes" tried.Try "$url" cloud.xyz
